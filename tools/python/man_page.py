"""Lays what the command's help says out as a man page, in the macros of man(7)."""

import datetime
import os
import re
import textwrap

ENTRY = re.compile(r"  (?! )(.*?\S) {2,}(\S.*)")  # "  missed, worst   share of the pairs"
CONTINUATION = re.compile(r" {10,}(\S.*)")


def escaped(text):
    return text.replace("\\", "\\e").replace("-", "\\-").replace("~", "\\(ti").replace("^", "\\(ha").replace(
        "`", "\\(ga").replace("'", "\\(aq")


def line(text):
    """A line of text: what begins with a dot or a quote would be a request."""
    return "\\&" + text if text.startswith((".", "'")) else text


def bold(text):
    return f"\\fB{escaped(text)}\\fP"


def filled(text):
    return [line(escaped(part)) for part in textwrap.wrap(text, 66, break_on_hyphens=False, break_long_words=False)]


def tagged(tag, text):
    return [".TP", line(tag), *(filled(text) or ["\\&"])]


def entries(block):
    """(name, text) of an indented block that is a table; None where it is none."""
    found = []
    for row in block:
        if entry := ENTRY.fullmatch(row):
            found.append([entry[1], entry[2]])
        elif (more := CONTINUATION.fullmatch(row)) and found:
            found[-1][1] += " " + more[1]
        else:
            return None
    return found


def notes(text):
    """Paragraphs are filled, tables become lists, and all else that is indented stays as it is."""
    out, rows = [], text.splitlines()
    while rows:
        inside = rows[0].startswith("  ")
        end = next((k for k, row in enumerate(rows) if row.startswith("  ") != inside or not row.strip()), len(rows))
        block, rows = rows[:end], rows[end:]
        if not block:
            rows = rows[1:]
        elif not inside:
            out += [".PP", *filled(" ".join(block))]
        elif table := entries(block):
            for name, what in table:
                out += tagged(escaped(name), what)
        else:
            out += [".PP", ".nf", *(line(escaped(row[2:])) for row in block), ".fi"]
    return out


def tag(option):
    """"--out TEXT, required" as a tag; the name bold, what it takes in italics."""
    names = ", ".join(bold(name) for name in option.names) if option.names else f"\\fI{option.argument}\\fP"
    takes = f" \\fI{escaped(option.type)}\\fP" if option.names and option.type else ""
    many = " ..." if option.many else ""
    default = f" [{escaped(option.default.strip('[]'))}]" if option.default else ""
    return names + takes + many + default + (" (required)" if option.required else "")


def day():
    """Of the build, so that the same help can give the same page; else today."""
    epoch = os.environ.get("SOURCE_DATE_EPOCH")
    now = datetime.datetime.fromtimestamp(int(epoch), datetime.UTC) if epoch else datetime.datetime.now(datetime.UTC)
    return now.date().isoformat()


def man_page(command):
    out = [f'.TH DECANT 1 {day()} "{command.version}" "User Commands"',
           ".SH NAME", f"decant \\- {escaped(command.what[0].lower() + command.what[1:].rstrip('.'))}",
           ".SH SYNOPSIS", f"{bold('decant')} \\fIVERB\\fP [\\fIOPTIONS\\fP] [\\fIARGUMENTS\\fP]", ".br",
           f"{bold('decant')} \\fIVERB\\fP {bold('--help')}", ".br", f"{bold('decant')} {bold('--version')}",
           ".SH DESCRIPTION"]
    for verb in command.verbs:
        out += tagged(bold(verb.name), verb.what)
    out += notes(command.notes)
    for verb in command.verbs:
        arguments = [f"[\\fI{o.argument}\\fP]" if not o.required else f"\\fI{o.argument}\\fP"
                     for o in verb.options if o.argument]
        synopsis = " ".join([bold("decant"), bold(verb.name), "[\\fIOPTIONS\\fP]", *arguments])
        out += [f".SH DECANT {verb.name.upper()}", synopsis, ".PP", *filled(f"{verb.what[0].upper()}{verb.what[1:]}.")]
        for option in verb.options:
            if "--help" not in option.names and not option.of_backends:
                out += tagged(tag(option), option.what)
        if any(o.of_backends for o in verb.options):
            out += [".PP", f"Takes {bold('OPTIONS OF BACKENDS')}, too."]
        out += notes(verb.notes)
    of_backends = {o.names: o for verb in command.verbs for o in verb.options if o.of_backends}
    if of_backends:
        out.append(".SH OPTIONS OF BACKENDS")
        for option in of_backends.values():
            out += tagged(tag(option), option.what)
    # A paragraph's macro after a heading's is one too many.
    kept = [row for k, row in enumerate(out) if not (row == ".PP" and k and out[k - 1].startswith(".SH"))]
    return "\n".join(kept) + "\n"
