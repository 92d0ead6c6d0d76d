#!/usr/bin/env python3
"""Writes completion for bash, zsh and fish and a man page from what `decant --help` and `decant VERB --help` say.

    shell_files.py --decant build/release/bin/decant --out ~/.local/share

Completed are verbs, options of the verb, values that the help lists, and names that the command itself lists,
of recordings and of cases; else files. What takes a number is left alone. Exit status: 0 written, 2 bad input.
"""

import argparse
import re
import shlex
import subprocess
from dataclasses import dataclass
from pathlib import Path

from command_help import help_of, verbs_of
from man_page import man_page
from one_line import refuse, run_main

NUMBERS = re.compile(r"U?INT|FLOAT")
BRACES = re.compile(r"\{([\w.-]+(?:,[\w.-]+)+)\}")
OF_BACKEND = re.compile(r"of (\w+): ")
WORD = re.compile(r"[a-z][\w-]*")
# Arguments whose names the command lists, and how; both take files as well where the flag says so.
LISTED = {"FIXTURE": ("conform --list", True), "CASE": ("validate --list", False)}
ORIGIN = "Written by tools/python/shell_files.py from the command's help."


@dataclass
class Option:
    """An option, or with `argument` a positional argument."""

    names: tuple
    argument: str
    type: str
    many: bool
    required: bool
    default: str
    what: str
    of_backends: bool
    values: tuple = ()

    @property
    def takes(self):
        """What completes its value: nothing (a flag), none (nobody can), values, listed or files."""
        if self.names and not self.type:
            return "nothing"
        if self.values:
            return "values"
        if self.argument in LISTED:
            return "listed"
        return "none" if NUMBERS.match(self.type or "") else "files"


@dataclass
class Verb:
    name: str
    what: str
    options: list
    notes: str

    @property
    def argument(self):
        """The positional argument; of several, the last."""
        return next((o for o in reversed(self.options) if o.argument), None)


@dataclass
class Command:
    version: str
    what: str
    verbs: list
    notes: str


def listed_values(option, notes, backends):
    """Values that the help lists: in braces, in words ("auto, cuda or host"), or in the notes ("Checks: ...")."""
    if braces := BRACES.search(f"{option.type} {option.what}"):
        return tuple(braces[1].split(","))
    if not option.names or not option.type or NUMBERS.match(option.type):
        return ()
    plural = re.escape(option.names[-1].lstrip("-").capitalize()) + "s"
    if named := re.search(rf"\b{plural}: ([a-z-]+(?:, [a-z-]+(?=[,.]))+)", " ".join(notes.split())):
        return tuple(named[1].split(", "))
    text = re.split(r"[;:] |$", OF_BACKEND.sub("", option.what), maxsplit=1)[0]
    found = [item for item in re.split(r",\s*(?:or\s+)?|\s+or\s+", text) if item]
    words = tuple(item for item in found if WORD.fullmatch(item))
    if option.of_backends:
        return words
    if "…" in found:
        return tuple(dict.fromkeys(words + tuple(backends)))
    return words if len(words) == len(found) > 1 else ()


def read_verb(decant, name, what):
    groups, notes = help_of(decant, name)
    options = []
    for group, of_backends in (("own", False), ("backends", True)):
        for found, description in groups[group]:
            names = tuple(re.split(r",\s*", found["name"])) if found["name"].startswith("-") else ()
            options.append(Option(names, "" if names else found["name"], found["type"], bool(found["many"]),
                                  bool(found["required"]), found["old"] or found["new"] or "",
                                  " ".join(description).strip(), of_backends))
    backends = dict.fromkeys(m[1] for o in options if o.of_backends and (m := OF_BACKEND.match(o.what)))
    for option in options:
        option.values = listed_values(option, notes, backends)
    return Verb(name, what, options, notes)


def read_command(decant):
    what, verbs, notes = verbs_of(decant)
    version = subprocess.run([decant, "--version"], capture_output=True, encoding="utf-8").stdout.strip()
    if not re.fullmatch(r"[\w.+ -]+", version):
        refuse(f"`{decant} --version` prints no version: {version}")
    command = Command(version, what, [read_verb(decant, name, said) for name, said in verbs.items()], notes)
    # Where one verb's help has no values for an option, those that all others agree on.
    for option in [o for verb in command.verbs for o in verb.options if o.names and o.takes == "files"]:
        known = [o.values for verb in command.verbs for o in verb.options if o.names == option.names and o.values]
        option.values = tuple(v for v in known[0] if all(v in others for others in known)) if known else ()
    return command


def valued(verb):
    return [o for o in verb.options if o.names and o.takes != "nothing"]


BASH = """\
# bash completion for decant. {origin}

# _decant_names ARGUMENTS: what the command lists, a name first on each line that is not indented.
_decant_names() {{
    local row
    "${{COMP_WORDS[0]/#\\~/$HOME}}" "$@" 2>/dev/null | while IFS= read -r row; do
        [[ $row == [![:space:]]* ]] && printf '%s\\n' "${{row%% *}}"
    done
}}

_decant_words() {{
    mapfile -t COMPREPLY < <(compgen -W "$1" -- "$cur")
}}

_decant_files() {{
    local found
    mapfile -t found < <(compgen -f -- "$cur")
    COMPREPLY+=("${{found[@]}}")
    compopt -o filenames 2>/dev/null
}}

_decant() {{
    local cur=${{COMP_WORDS[COMP_CWORD]}} verb= option= at place
    COMPREPLY=()
    for ((at = 1; at < COMP_CWORD; ++at)); do
        [[ ${{COMP_WORDS[at]}} != -* ]] && verb=${{COMP_WORDS[at]}} && break
    done
    if [[ -z $verb ]]; then
        _decant_words '{verbs} --help --version'
        return
    fi
    # The option whose value stands here. --option=value is three words; some options take several values.
    [[ $cur == = ]] && cur=
    for ((place = COMP_CWORD - 1; place > at; --place)); do
        [[ ${{COMP_WORDS[place]}} == -* ]] || continue
        option=${{COMP_WORDS[place]}}
        if ((place < COMP_CWORD - 1)) && [[ ${{COMP_WORDS[place + 1]}} != = || $((COMP_CWORD - place)) -gt 2 ]]; then
            case $verb:$option in
                {many}) ;;
                *) option= ;;
            esac
        fi
        break
    done
    if [[ $cur != -* ]]; then
        case $verb:$option in
{values}
        esac
    fi
    case $verb in
{arguments}
    esac
}}

complete -F _decant decant
"""


def bash(command):
    cases = {}
    for verb in command.verbs:
        for o in valued(verb):
            action = {"values": f"_decant_words {shlex.quote(' '.join(o.values))}", "files": "_decant_files",
                      "none": ":"}[o.takes]
            cases.setdefault(action, []).extend(f"{verb.name}:{name}" for name in o.names)
    values = ["\n".join([f"            {' | '.join(patterns)})", f"                {action}", "                return",
                         "                ;;"]) for action, patterns in cases.items()]
    arguments = []
    for verb in command.verbs:
        options = " ".join(name for o in verb.options for name in o.names if name.startswith("--"))
        rows = [f"        {verb.name})", "            if [[ $cur == -* ]]; then",
                f"                _decant_words {shlex.quote(options)}"]
        if verb.argument:
            rows.append("            else")
            files = verb.argument.takes == "files"
            if verb.argument.takes == "listed":
                listing, files = LISTED[verb.argument.argument]
                rows.append(f'                _decant_words "$(_decant_names {listing})"')
            if files:
                rows.append("                _decant_files")
        arguments += [*rows, "            fi", "            ;;"]
    many = " | ".join(f"{v.name}:{name}" for v in command.verbs for o in valued(v) if o.many for name in o.names)
    return BASH.format(origin=ORIGIN, verbs=" ".join(v.name for v in command.verbs), many=many or "''",
                       values="\n".join(values), arguments="\n".join(arguments))


ZSH = """\
#compdef decant
# zsh completion for decant. {origin}

# _decant_names TAG ARGUMENTS: what the command lists, a name first on each line that is not indented.
_decant_names() {{
    local -a rows names
    local tag=$1
    shift
    rows=("${{(@f)$("${{_decant_command/#\\~/$HOME}}" "$@" 2>/dev/null)}}")
    names=(${{${{rows:#[[:space:]]*}}%% *}})
    compadd -X $tag -a names
}}

{functions}

_decant() {{
    local curcontext=$curcontext state line _decant_command=$words[1]
    typeset -A opt_args
    _arguments -C '(- *)'{{-h,--help}}'[help]' '(- *)'{{-V,--version}}'[version]' '1:verb:->verb' '*::argument:->rest'
    case $state in
        verb)
            local -a verbs=(
{verbs}
            )
            _describe verb verbs
            ;;
        rest)
            (( $+functions[_decant_$words[1]] )) && _decant_$words[1]
            ;;
    esac
}}

_decant "$@"
"""


def zsh_action(option):
    if option.takes == "listed":
        listing, files = LISTED[option.argument]
        # Braces: the words are run as they stand, without options for compadd that come first.
        names = f"{{_decant_names {option.argument.lower()} {listing}"
        return names + ("; _files}" if files else "}")
    return {"values": f"({' '.join(option.values)})", "files": "_files", "none": " "}[option.takes]


def zsh_text(text):
    return re.sub(r"([\[\]:\\])", r"\\\1", text)


def zsh(command):
    functions = []
    for verb in command.verbs:
        specs = []
        for o in verb.options:
            if o.names == ("-h", "--help"):
                specs.append("'(- *)'{-h,--help}'[help]'")
            elif o.names:
                often = "*" if o.many else ""
                for name in o.names:
                    takes = "" if o.takes == "nothing" else f":{zsh_text(o.type.split(':')[0])}:{zsh_action(o)}"
                    equals = "=" if takes and name.startswith("--") else ""
                    specs.append(shlex.quote(f"{often}{name}{equals}[{zsh_text(o.what)}]{takes}"))
            else:
                place = "*" if o.many else ""
                specs.append(shlex.quote(f"{place}:{o.argument}:{zsh_action(o)}"))
        arguments = " \\\n        ".join(["_arguments -s", *specs])
        functions.append(f"_decant_{verb.name}() {{\n    {arguments}\n}}")
    verbs = "\n".join(" " * 16 + shlex.quote(f"{v.name}:{v.what}") for v in command.verbs)
    return ZSH.format(origin=ORIGIN, functions="\n\n".join(functions), verbs=verbs)


def fish_text(text):
    return "'" + text.replace("\\", "\\\\").replace("'", "\\'") + "'"


def fish(command):
    out = [f"# fish completion for decant. {ORIGIN}", "",
           "# What the command lists, a name first on each line that is not indented.",
           "function __decant_names", "    set -l command (commandline -opc)[1]",
           "    $command $argv 2>/dev/null | string match -r '^\\S+'", "end", "",
           "complete -c decant -f", "complete -c decant -n __fish_use_subcommand -s V -l version -d 'version'",
           "complete -c decant -n __fish_use_subcommand -s h -l help -d 'help'"]
    for verb in command.verbs:
        out.append(f"complete -c decant -n __fish_use_subcommand -a {verb.name} -d {fish_text(verb.what)}")
    for verb in command.verbs:
        start = f"complete -c decant -n '__fish_seen_subcommand_from {verb.name}'"
        for o in verb.options:
            said = f" -d {fish_text(o.what)}"
            if o.names:
                names = "".join(f" -l {n[2:]}" if n.startswith("--") else f" -s {n[1:]}" for n in o.names)
                out.append(start + names + {"nothing": "", "none": " -x", "files": " -r -F",
                                            "values": f" -x -a {fish_text(' '.join(o.values))}"}[o.takes] + said)
            elif o.takes == "listed":
                listing, files = LISTED[o.argument]
                out.append(f"{start}{' -F' if files else ''} -a '(__decant_names {listing})'")
            else:
                out.append(f"{start} -F")
    return "\n".join(out) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--decant", required=True, help="the command")
    parser.add_argument("--out", required=True, type=Path, help="folder for what is written, such as ~/.local/share")
    arguments = parser.parse_args()
    command = read_command(arguments.decant)
    for place, written in (("bash-completion/completions/decant", bash(command)),
                           ("zsh/site-functions/_decant", zsh(command)),
                           ("fish/vendor_completions.d/decant.fish", fish(command)),
                           ("man/man1/decant.1", man_page(command))):
        path = arguments.out / place
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(written, encoding="utf-8")
        print(path)
    return 0


if __name__ == "__main__":
    run_main(main)
