"""What each check compares, where its bound is from and what it cannot see: in the words of the oracle, none kept here.

A report does not say it. `decant conform --explain CHECK` prints it, from strings in oracle/checks/checks.cpp; both
are read here, so that a page needs no built program and says what the program does.
"""

import json
import re
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[2] / "oracle" / "checks" / "checks.cpp"
PARTS = {"bound": "bound", "does not see": "blind"}

LITERAL = r'"(?:[^"\\]|\\.)*"'
TEXT = rf"({LITERAL}(?:\s*{LITERAL})*)"
ENTRY = re.compile(r"\{\s*" + r"\s*,\s*".join([TEXT] * 4) + r"\s*,?\s*\}")


def of_source(text):
    """From initializers {name, compares, bound, blind} of C++, whose adjacent literals are one text."""
    found = {}
    for match in ENTRY.finditer(text):
        # Escapes of these literals are those of JSON.
        name, *parts = ("".join(json.loads(s) for s in re.findall(LITERAL, group)) for group in match.groups())
        found[name] = dict(zip(("compares", "bound", "blind"), parts))
    return found


def of_output(text):
    """From what --explain prints, of any number of checks one after the other: names and headings are not indented."""
    found, part = {}, None
    for line in text.splitlines():
        if not line.strip():
            continue
        if line[0].isspace():
            if found:
                entry = found[list(found)[-1]]
                entry[part] = f"{entry[part]} {line.strip()}".strip()
        elif found and line.strip() in PARTS:
            part = PARTS[line.strip()]
        else:
            found[line.strip()] = dict.fromkeys(("compares", "bound", "blind"), "")
            part = "compares"
    return {name: entry for name, entry in found.items() if all(entry.values())}


def explanations(path=None):
    """By name of check, in the oracle's order. Of the file given, or of this checkout's source; empty where a script
    stands alone, without that."""
    if path is None and not SOURCE.exists():
        return {}
    path = path or SOURCE
    text = path.read_text(encoding="utf-8", errors="replace")
    found = of_source(text) or of_output(text)
    if not found:
        raise OSError(f"{path}: explains no check")
    return found


def check_of(row_check, explained):
    """The check that a row belongs to. Rows of `fields` are called after its stages, which its text has in
    parentheses."""
    if row_check not in explained:
        for name, parts in explained.items():
            if row_check in ", ".join(re.findall(r"\(([^()]*)\)", parts["compares"])).split(", "):
                return name
    return row_check
