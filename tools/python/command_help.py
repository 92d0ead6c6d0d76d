"""What `decant --help` and `decant VERB --help` say, as data: verbs, options, what they take, notes below them."""

import re
import subprocess

from one_line import refuse

GROUPS = {"positionals": "own", "options": "own", "options of backends": "backends"}
CONTINUED = 12 * " "  # descriptions begin further on, names do not
# "--windows INT:INT in [1 - 1000]=5 ... REQUIRED  what"; later CLI11 writes " [5] " instead of "=5".
OPTION = re.compile(r"  (?P<name>(?:-\w,\s*)?--[\w-]+|[A-Z]+)"
                    r"(?: (?P<type>[A-Z]+(?::(?:[A-Z]+ in \[[^\]]*\]|\{[^}]*\}))?|\{[^}]*\})"
                    r"(?:=(?P<old>\S+)| \[(?P<new>\S+)\])?"
                    r"(?P<many> +\.\.\.)?(?P<required> +REQUIRED)?)?(?: +(?P<what>\S.*))?")
VERB = re.compile(r"  (?P<name>[a-z][\w-]*) +(?P<what>\S.*)")


def run_help(decant, *verb):
    asked = " ".join([str(decant), *verb, "--help"])
    try:
        run = subprocess.run([decant, *verb, "--help"], capture_output=True, encoding="utf-8", errors="replace")
    except OSError as error:
        refuse(error)
    if run.returncode != 0:
        refuse(f"`{asked}` exits with {run.returncode}: {run.stderr.strip()}")
    return run.stdout.splitlines()


def help_of(decant, verb):
    """Options by group, each a match of OPTION with the lines of its description; and the notes below them."""
    groups, group, lines = {"own": [], "backends": []}, None, run_help(decant, verb)
    for at, line in enumerate(lines):
        heading = GROUPS.get(line.rstrip(":").lower()) if line.endswith(":") else None
        if heading:
            group = groups[heading]
        elif group is None or not line.strip():
            continue
        elif not line.startswith("  "):
            return groups, "\n".join(lines[at:]).strip()
        elif line.startswith(CONTINUED) and group:
            group[-1][1].append(line.strip())
        else:
            option = OPTION.fullmatch(line.rstrip())
            if not option:
                refuse(f"cannot read this line of `{verb} --help`: {line}")
            group.append((option, [option["what"] or ""]))
    if not groups["own"]:
        refuse(f"`{decant} {verb} --help` lists no options")
    return groups, ""


def verbs_of(decant):
    """What the command is for, its verbs with what each does, and the notes below them."""
    lines = run_help(decant)
    if "Subcommands:" not in lines:
        refuse(f"`{decant} --help` lists no verbs")
    verbs, start = {}, lines.index("Subcommands:") + 1
    for at, line in enumerate(lines[start:], start):
        verb = VERB.fullmatch(line.rstrip())
        if verb:
            verbs[verb["name"]] = verb["what"]
        elif line.startswith(CONTINUED) and verbs:
            verbs[next(reversed(verbs))] += " " + line.strip()
        elif line.strip():
            return lines[0], verbs, "\n".join(lines[at:]).strip()
    return lines[0], verbs, ""
