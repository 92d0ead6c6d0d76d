#!/usr/bin/env python3
"""Fills a document with the options that `decant VERB --help` lists, so that neither drifts from the other.

    command_reference.py --decant build/release/bin/decant tools/README.md
    command_reference.py --decant build/release/bin/decant --check tools/README.md

Blocks stand between `<!-- help: VERB -->` (a table of the verb's own options), `<!-- help: VERB backends -->`
(the options that every verb with backends shares) or `<!-- help: VERB notes -->` (what the help says below
its options), and `<!-- /help -->`. Exit status: 0 written, or the same; 1 with --check where they differ;
2 bad input.
"""

import argparse
import difflib
import re
import sys
from pathlib import Path

from command_help import help_of
from one_line import read_text, refuse, run_main

BLOCK = re.compile(r"(<!-- help: (\S+)(?: (\S+))? -->\n).*?(<!-- /help -->)", re.DOTALL)


def table(options):
    rows = ["| option | default | what |", "|---|---|---|"]
    for option, description in options:
        if option["name"].endswith("--help"):
            continue
        value = " ".join(filter(None, (option["name"], option["type"], "…" if option["many"] else "")))
        default = option["old"] or option["new"]
        default = f"`{default}`" if default else "required" if option["required"] else ""
        what = " ".join(description).strip().replace("|", "\\|").replace("<", "&lt;")
        rows.append(" | ".join((f"| `{value}`", default, what + " |")).replace("|  |", "| |"))
    return "\n".join(rows)


def block(decant, verb, part):
    groups, notes = help_of(decant, verb)
    if part == "backends":
        return table(groups["backends"])
    if part == "notes":
        return f"```text\n{notes}\n```"
    if part:
        refuse(f"unknown part '{part}' of {verb}: backends or notes")
    return table(groups["own"])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("document", type=Path)
    parser.add_argument("--decant", required=True, help="the command")
    parser.add_argument("--check", action="store_true", help="write nothing; exit status 1 where they differ")
    arguments = parser.parse_args()
    before = read_text(arguments.document, "a document")
    if not BLOCK.search(before) or before.count("<!-- help: ") != len(BLOCK.findall(before)):
        refuse(f"{arguments.document}: no pairs of `<!-- help: VERB -->` and `<!-- /help -->`")
    after = BLOCK.sub(lambda m: f"{m[1]}{block(arguments.decant, m[2], m[3])}\n{m[4]}", before)
    if not arguments.check:
        arguments.document.write_text(after, encoding="utf-8")
    elif after != before:
        sys.stdout.writelines(difflib.unified_diff(
            before.splitlines(True), after.splitlines(True), str(arguments.document), "decant --help"))
        return 1
    return 0


if __name__ == "__main__":
    run_main(main)
