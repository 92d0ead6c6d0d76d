#!/usr/bin/env python3
"""Holds fixtures, reports, and files for or from a port that is not linked to their documents.

    check_schema.py FILE.h5 …

Reads the table in oracle/formats/fixture.md, or that of reports, results, validations, drift or fuzzing,
and compares names, dtypes, shapes and units with what stands in the file. Exit status: 0 as documented, 1 not,
2 bad input.
"""

import json
import re
import sys
from pathlib import Path

import h5py
import numpy as np

from one_line import open_hdf5, refuse, run_main

FORMATS = Path(__file__).resolve().parents[2] / "oracle" / "formats"
PARTS = ("inputs", "results", "reference")  # all in results.md
KINDS = [f"decant_{kind}" for kind in ("fixture", "validation", "drift", "fuzz", "report", *PARTS)]


def rows_of(document):
    """The table's rows: path, dtype, shape, unit, in."""
    rows = []
    for line in document.read_text(encoding="utf-8").splitlines():
        cells = [c.strip() for c in re.split(r"(?<!\\)\|", line)[1:-1]]
        if cells and cells[0].startswith(("`/", "`STATE")):
            rows.append((cells[0].strip("`"), *cells[1:5]))
    if not rows:
        refuse(f"{document}: no table")
    return rows


def dtype_of(dtype):
    return "string" if dtype.kind == "S" else dtype.name


def is_of(dtype, expected):
    """Whether a dtype is the documented one; "real", "integer" and "real or integer" are classes."""
    kinds = {"real": "f", "integer": "iu", "real or integer": "fiu"}
    return dtype.kind in kinds[expected] if expected in kinds else dtype_of(dtype) == expected


class Checker:
    """Collects what differs, and the lengths that the letters N, M, … stand for."""

    def __init__(self, file):
        self.file, self.complaints, self.lengths = file, [], {}

    def complain(self, path, text):
        self.complaints.append(f"{path}: {text}")

    def shape(self, path, found, expected, scope):
        if expected == "scalar":
            if found != ():
                self.complain(path, f"shape {list(found)}, expected a scalar")
            return
        if expected == "[N…]":
            if not 1 <= len(found) <= 3:
                self.complain(path, f"shape {list(found)}, expected [N], [N,K] or [N,K,L]")
                return
            expected = "[" + ",".join(["N", *map(str, found[1:])]) + "]"
        letters = expected.strip("[]").split(",")
        if len(letters) != len(found):
            self.complain(path, f"shape {list(found)}, expected {expected}")
            return
        for letter, length in zip(letters, found):
            if letter.isdigit():
                known = int(letter)
            else:
                known = self.lengths.setdefault((scope, letter), length)
            if known != length:
                self.complain(path, f"shape {list(found)}, expected {expected} with {letter} = {known}")

    def dataset(self, path, dtype, shape, unit, scope=""):
        item = self.file.get(path)
        if not isinstance(item, h5py.Dataset):
            self.complain(path, "missing")
            return
        if not is_of(item.dtype, dtype):
            self.complain(path, f"dtype {item.dtype}, expected {dtype}")
        self.shape(path, item.shape, shape, scope)
        found = item.attrs.get("unit", b"").decode()
        if unit not in ("the row's", "the field's", "any") and found != unit:
            self.complain(path, f'unit "{found}", expected "{unit}"')

    def attribute(self, owner, name, dtype, shape):
        path = f"{owner}@{name}"
        item = self.file.get(owner)
        if item is None or (name != "*" and name not in item.attrs):
            self.complain(path, "missing")
            return
        for each in item.attrs if name == "*" else [name]:
            found = item.attrs.get_id(each)
            if not is_of(found.dtype, dtype):
                self.complain(f"{owner}@{each}", f"dtype {found.dtype}, expected {dtype}")
            self.shape(f"{owner}@{each}", found.shape, shape, "")

    def row(self, path, dtype, shape, unit, scope=""):
        if "@" in path:
            owner, name = path.split("@")
            self.attribute(owner if owner == "/" else owner.rstrip("/"), name, dtype, shape)
        else:
            self.dataset(path, dtype, shape, unit, scope)


def check_fixture(check, rows):
    file = check.file
    kinds = {"all", "small" if "oracle" in file else "study"}
    for path, dtype, shape, unit, where in rows:
        if where in kinds:
            check.row(path, dtype, shape, unit)
    if check.complaints:
        return
    json.loads(file["scene"][()].decode("utf-8"))
    if "oracle" in file and file["oracle/boundary_volume"].shape[0] != file["walls"].attrs["count"]:
        check.complain("/walls@count", "is not the number of boundary volumes")


def check_report(check, rows):
    file = check.file
    kinds = {"all", "points"} if "VTKHDF" in file else {"all"}
    for path, dtype, shape, unit, where in rows:
        if where in kinds:
            check.row(path, dtype, shape, unit)
    for name, group in file.get("checks", {}).items():
        kinds = {"each", group.attrs["kept"].decode() if "kept" in group.attrs else ""}
        for path, dtype, shape, unit, where in rows:
            if where in kinds:
                check.row(path.replace("*", name, 1), dtype, shape, unit, scope=name)
    if check.complaints:
        return
    verdict = file["summary/verdict"][:]
    score = file["summary/score"][:]
    if set(verdict) - {b"pass", b"fail", b"not_run"}:
        check.complain("/summary/verdict", "a value other than pass, fail, not_run")
    if not np.all(score[verdict == b"pass"] <= 1):
        check.complain("/summary/score", "a passing row without a score of at most 1")
    documented = {path.rsplit("/", 1)[1] for path, *_ in rows if path.startswith("/summary/")}
    for name in set(file["summary"]) - documented:
        check.complain(f"/summary/{name}", "not in the document")


def check_columns(check, rows, schema=0):
    """Rows of all files of a kind, and those that stand there from a schema on."""
    for path, dtype, shape, unit, where in rows:
        if where == "all" or (where.isdecimal() and schema >= int(where)):
            check.row(path, dtype, shape, unit)


def check_validation(check, rows):
    file = check.file
    check_columns(check, rows)
    for name in file.get("curves", {}):
        for path, dtype, shape, unit, where in rows:
            if where == "curve":
                check.row(path.replace("*", name, 1), dtype, shape, unit, scope=name)
    if check.complaints:
        return
    if set(file["quantities/verdict"][:]) - {b"pass", b"fail", b"reported"}:
        check.complain("/quantities/verdict", "a value other than pass, fail, reported")


def check_parts(check, rows, kind):
    """Inputs, results, references: rows of this kind, and those of kind? where they are there."""
    file = check.file
    named = {path for path, *_ in rows}
    states = [""] if "fields" in file else [f"/{k}" for k in file if f"{k}/fields" in file]
    for path, dtype, shape, unit, where in rows:
        kinds = {k.strip() for k in where.split(",")}
        if not kinds & {kind, kind + "?"}:
            continue
        for state in states if path.startswith("STATE") else [""]:
            owner, at, attribute = path.replace("STATE", state).partition("@")
            names = sorted(file.get(owner[:-2], ())) if owner.endswith("/*") else [""]
            for one in (owner.replace("*", name) for name in names):
                there = one in file and (not at or attribute in file[one].attrs)
                if (one in named and one != path) or (kind not in kinds and not there):
                    continue
                # Who writes results or a reference may leave units out.
                stated = kind == "inputs" or (there and "unit" in file[one].attrs)
                check.row(one + at + attribute, dtype, shape, unit if stated else "any", state)
    if kind == "reference" and not states:
        check.complain("/fields", "missing")


def complaints_about(path):
    with open_hdf5(path, KINDS, "a file that a schema document describes") as file:
        check = Checker(file)
        if "decant_fixture" in file.attrs:
            check_fixture(check, rows_of(FORMATS / "fixture.md"))
        elif "decant_validation" in file.attrs:
            check_validation(check, rows_of(FORMATS / "validation.md"))
        elif "decant_drift" in file.attrs:
            check_columns(check, rows_of(FORMATS / "drift.md"))
        elif "decant_fuzz" in file.attrs:
            check_columns(check, rows_of(FORMATS / "fuzz.md"), int(file.attrs["decant_fuzz"]))
        elif "decant_report" in file.attrs:
            check_report(check, rows_of(FORMATS / "report.md"))
        else:
            kind = next(k for k in PARTS if f"decant_{k}" in file.attrs)
            check_parts(check, rows_of(FORMATS / "results.md"), kind)
        return check.complaints


def main():
    paths = sys.argv[1:]
    if not paths or paths[0].startswith("-"):
        print(__doc__, end="", file=sys.stderr if paths not in (["-h"], ["--help"]) else sys.stdout)
        return 0 if paths in (["-h"], ["--help"]) else 2
    failed = False
    for path in paths:
        found = complaints_about(path)
        for text in found:
            print(f"{path}: {text}")
        print(f"{path}: {'not as documented' if found else 'as documented'}")
        failed |= bool(found)
    return int(failed)


if __name__ == "__main__":
    run_main(main)
