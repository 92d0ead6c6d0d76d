#!/usr/bin/env python3
"""Writes fixtures/results/foreign/README.md from the JSON files beside it.

--check writes nothing and ends with status 1 where the page differs from them."""

import argparse
import difflib
import json
import sys
from pathlib import Path

FOLDER = Path(__file__).resolve().parents[2] / "fixtures" / "results" / "foreign"
HEAD = """# Foreign codes judged

Public packages, installed at pinned versions and driven through their public interface, compared by
`decant conform` with double-precision references of their own formulas, or with the oracle on a fixture. The
scripts are in [tools/foreign](../../../tools/foreign); `tools/foreign/judge.sh CODE` makes a code's JSON file again.
This page is made from those files by `tools/foreign/table.py`.

A score is the largest |error| / tolerance of one value; up to 1 passes; `inf` is a count that differs, or NaN.
N is the number of particles, of a kernel that of distances. *Mended* is the verdict after a change from outside,
without an edit of the package. *Control* is the smallest score of the same values, mended ones where they are
mended, with an error planted: a factor of 1.0001, one neighbor more, or one pair missing from a list. It has to be
above 1. Fields of the same comparison that pass share a line, which has their largest score; the JSON files have a
row per field.
"""
TITLES = ("compared", "with", "state", "N", "field", "score", "verdict", "fault", "mended", "control")


def number(value):
    value = float(value)  # JSON has no NaN: it is a text there
    return f"{value:,.0f}" if 1000 <= value < 1e5 else f"{value:.3g}"


def names(fields):
    if len(fields) > 6:
        return f"`density`, `acceleration` and {len(fields) - 2} others"
    return ", ".join(f"`{name}`" for name in fields)


def line(rows):
    first, worst = rows[0], max(rows, key=lambda row: float(row["score"]))
    controls = [float(row["control_score"]) for row in rows if "control_score" in row]
    mended = f"{first['mend']}: {first['mended_verdict']}, {number(first['mended_score'])}" if "mend" in first else "–"
    return (first["compared"], first["with"], first["state"], f"{first['particles']:,}",
            names([row["field"] for row in rows]), number(worst["score"]), first["verdict"], first["fault"],
            mended, number(min(controls)) if controls else "–")


def section(data):
    groups = {}
    for k, row in enumerate(data["rows"]):
        own = k if row["verdict"] == "fail" or "mend" in row else None
        groups.setdefault((row["compared"], row["with"], row["state"], own), []).append(row)
    versions = ", ".join(f"{name} {version}" for name, version in data["versions"].items())
    failing = sum(row["verdict"] == "fail" for row in data["rows"])
    lines = [f"\n## {data['code']}\n", f"{versions}; Python {data['python']}, {data['machine']}. "
             f"{len(data['rows'])} rows, {failing} fail. Command: `{data['command']}`\n",
             "| " + " | ".join(TITLES) + " |", "|" + "---|" * len(TITLES)]
    return lines + ["| " + " | ".join(cell.replace("|", "\\|") for cell in line(rows)) + " |"
                    for rows in groups.values()]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true")
    check = parser.parse_args().check
    lines = [HEAD.rstrip("\n")]
    for path in sorted(FOLDER.glob("*.json")):
        lines += section(json.loads(path.read_text(encoding="utf-8")))
    page, made = FOLDER / "README.md", "\n".join(lines) + "\n"
    if not check:
        page.write_text(made, encoding="utf-8")
        return 0
    found = page.read_text(encoding="utf-8") if page.exists() else ""
    sys.stdout.writelines(difflib.unified_diff(found.splitlines(True), made.splitlines(True), str(page), "made now"))
    return int(found != made)


if __name__ == "__main__":
    sys.exit(main())
