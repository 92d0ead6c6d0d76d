"""Which report the reports of blocks make together: of `fuzz`, `drift` or `validate`, and nothing counts twice.

Each class takes files one after another, in any number, and writes the whole. The layouts are in oracle/formats/. Needs
h5py and numpy, and nothing else of the package.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np

# Of a schema of `fuzz`: coverage tags, statistics per property and backend, counterexamples.
_NOW = ("tags", "statistics", "counterexamples")
GROUPS = {1: ("classes", "tallies", "findings"), 2: _NOW, 3: _NOW}


class JoinError(ValueError):
    """Reports that cannot be joined, or a file that is no such report: the file, what it has, what was expected."""


def opened(path: str | Path, mark: str) -> h5py.File:
    """A report, open to read. Raises JoinError where it is cut off, or its root has no attribute `mark`."""
    try:
        file = h5py.File(path, "r")
    except OSError as error:
        raise JoinError(f"{path}: no HDF5 file, or cut off: {error}") from None
    if mark not in file.attrs:
        file.close()
        raise JoinError(f"{path}: no attribute {mark}: not a report of decant {mark.removeprefix('decant_')}")
    return file


def revision_of(file: h5py.File) -> str:
    """The git revision of the command that wrote it."""
    found = file["provenance"].attrs.get("git_revision", b"unknown")
    return found.decode() if isinstance(found, bytes) else str(found)


class Table:
    """Columns of equal length, with the attributes that they had in the first file."""

    def __init__(self) -> None:
        self.parts: list[dict[str, np.ndarray]] = []
        self.attributes: dict[str, dict[str, Any]] = {}

    def add(self, group: h5py.Group) -> dict[str, np.ndarray]:
        """The rows of a group behind those that are there; returns them."""
        columns = {name: data[:] for name, data in group.items() if isinstance(data, h5py.Dataset)}
        for name, data in group.items():
            self.attributes.setdefault(name, dict(data.attrs))
        self.parts.append(columns)
        return columns

    def columns(self) -> dict[str, np.ndarray]:
        """All rows."""
        return {name: np.concatenate([part[name] for part in self.parts]) for name in self.parts[0]}

    def write(self, out: h5py.File, group: str, columns: dict[str, np.ndarray] | None = None) -> None:
        """These columns, or all rows, as a group."""
        made = out.require_group(group)
        for name, values in (self.columns() if columns is None else columns).items():
            made.create_dataset(name, data=values).attrs.update(self.attributes[name])


class Report:
    """What all kinds share: the root's attributes, provenance, and that one revision and executor made them."""

    mark = ""
    once = ("executor",)  # attributes of the root that have to be equal

    def __init__(self) -> None:
        self.first: str | None = None
        self.root: dict[str, Any] = {}
        self.provenance: dict[str, Any] = {}
        self.devices: list[bytes] = []

    def add(self, path: str | Path) -> None:
        """One more report. Raises JoinError where it is of another kind, revision or executor than the first."""
        with opened(path, self.mark) as file:
            try:
                self.check(file)
                self.take(file)
            except KeyError as error:
                raise JoinError(f"{path}: {error.args[0]}") from None

    def check(self, file: h5py.File) -> None:
        here = {name: file.attrs[name] for name in (self.mark, *self.once)}
        if self.first is None:
            self.first, self.root = file.filename, here
            self.provenance = dict(file["provenance"].attrs)
            self.revision = revision_of(file)
        for name, value in here.items():
            if value != self.root[name]:
                raise JoinError(f"{file.filename}: {name}: {_said(value)}, expected {_said(self.root[name])} as in "
                                f"{self.first}")  # fmt: skip
        if revision_of(file) != self.revision:
            raise JoinError(f"{file.filename}: git_revision: {revision_of(file)}, expected {self.revision} as in "
                            f"{self.first}")  # fmt: skip
        if "device" in file.attrs and file.attrs["device"] not in self.devices:
            self.devices.append(file.attrs["device"])

    def take(self, file: h5py.File) -> None:
        raise NotImplementedError

    def write(self, path: str | Path) -> None:
        """The whole, in HDF5 1.8's format, whose headers carry checksums."""
        with h5py.File(path, "w", libver="v108") as out:
            out.attrs.update(self.root)
            if self.devices:
                out.attrs["device"] = np.bytes_(b", ".join(map(bytes, self.devices)))
            out.create_group("provenance").attrs.update(self.provenance)
            self.put(out)

    def put(self, out: h5py.File) -> None:
        raise NotImplementedError


class FuzzReport(Report):
    """Of `fuzz`, of seeds that do not overlap. Of several counterexamples to one property of one backend the one with
    the smallest seed is kept, as one thread would have found it."""

    mark = "decant_fuzz"

    def __init__(self) -> None:
        super().__init__()
        self.ranges: list[tuple[int, int, str]] = []
        self.cases = self.undecidable = 0
        self.seconds = 0.0
        self.rows: dict[tuple[bytes, bytes], dict[str, Any]] = {}
        self.found: dict[tuple[bytes, bytes], dict[str, Any]] = {}
        self.tables: dict[str, Table] = {}
        self.tag_names: list[bytes] = []
        self.tag_cases = np.zeros(0, np.int64)

    def take(self, file: h5py.File) -> None:
        schema = int(file.attrs[self.mark])
        if schema not in GROUPS:
            raise JoinError(f"{file.filename}: {self.mark}: {schema}, expected {' or '.join(map(str, GROUPS))}")
        tags, statistics, counterexamples = self.groups = GROUPS[schema]
        first, cases = int(file.attrs["first_seed"]), int(file.attrs["cases"])
        self.ranges.append((first, cases, file.filename))
        self.cases += cases
        self.undecidable += int(file.attrs["undecidable"])
        self.seconds += float(file.attrs["seconds"])
        self._take_tags(file, tags)
        for name in (statistics, counterexamples):
            columns = self.tables.setdefault(name, Table()).add(file[name])
            for k in range(len(columns["property"])):
                row = {key: values[k] for key, values in columns.items()}
                (self._count if name == statistics else self._keep)(row)

    def _take_tags(self, file: h5py.File, tags: str) -> None:
        columns = self.tables.setdefault(tags, Table()).add(file[tags])
        names = list(columns["name"])
        if not self.tag_names:
            self.tag_names, self.tag_cases = names, np.zeros_like(columns["cases"])
        if names != self.tag_names:
            raise JoinError(f"{file.filename}: {tags}/name: other tags than {self.first}")
        self.tag_cases = self.tag_cases + columns["cases"]

    def _count(self, row: dict[str, Any]) -> None:
        key = (bytes(row["property"]), bytes(row["backend"]))
        known = self.rows.get(key)
        if known is None:
            self.rows[key] = row
            return
        for name in row:
            if name in ("asked", "failed", "stepwise") or name.startswith("score_"):
                known[name] += row[name]
        if row.get("stepwise"):
            seeds = [r["stepwise_seed"] for r in (known, row) if r["stepwise_seed"] >= 0]
            known["stepwise_seed"] = min(seeds)
        # Of equal scores the smallest seed counts, as in one campaign.
        if (-row["worst"], row["worst_seed"]) < (-known["worst"], known["worst_seed"]):
            known.update({name: row[name] for name in ("worst", "worst_seed", "worst_field")})

    def _keep(self, row: dict[str, Any], again: bool = False) -> None:
        key = (bytes(row["property"]), bytes(row["backend"]))
        known = self.found.get(key)
        if known is None or row["seed"] < known["seed"] or (again and row["seed"] == known["seed"]):
            self.found[key] = row

    def minimised(self, path: str | Path) -> None:
        """A report of one seed again, whose counterexamples stand in place of those of the same seed."""
        with opened(path, self.mark) as file:
            self.check(file)
            columns = self.tables[self.groups[2]].add(file[self.groups[2]])
            for k in range(len(columns["property"])):
                row = {key: values[k] for key, values in columns.items()}
                if (bytes(row["property"]), bytes(row["backend"])) in self.found:
                    self._keep(row, again=True)

    def failed(self) -> int:
        """Cases that failed, over all properties and backends."""
        return int(sum(row["failed"] for row in self.rows.values()))

    def overlap(self) -> str | None:
        """Of two reports with a common seed which, and the seed."""
        ranges = sorted(self.ranges)
        for (first, cases, name), (following, _, other) in zip(ranges, ranges[1:]):
            if first + cases > following:
                return f"{name} and {other} both have seed {following}"
        return None

    def put(self, out: h5py.File) -> None:
        tags, statistics, counterexamples = self.groups
        out.attrs["first_seed"] = np.int64(min(first for first, _, _ in self.ranges))
        out.attrs["cases"], out.attrs["undecidable"] = np.int64(self.cases), np.int64(self.undecidable)
        out.attrs["seconds"] = np.float64(self.seconds)
        self.tables[tags].write(out, tags, {"name": np.array(self.tag_names), "cases": self.tag_cases})
        for name, rows in (
            (statistics, [self.rows[key] for key in sorted(self.rows)]),
            (counterexamples, sorted(self.found.values(), key=lambda r: (r["seed"], r["backend"], r["property"]))),
        ):
            like = self.tables[name].columns()
            self.tables[name].write(
                out, name, {key: np.array([row[key] for row in rows]) if rows else like[key][:0] for key in like}
            )


def missing_seeds(ranges: Iterable[tuple[int, int, str]], first: int, cases: int) -> str | None:
    """What ranges (first seed, cases, file) lack of the seeds first … first + cases − 1, or have beside them; None
    where they are exactly those."""
    following = first
    for begin, count, name in sorted(ranges):
        if begin > following:
            return f"seeds {following} to {begin - 1} are in no report"
        if begin < following:
            return f"{name}: seeds {begin} to {begin + count - 1}, expected {following} to {first + cases - 1}"
        following = begin + count
    if following != first + cases:
        return f"seeds {following} to {first + cases - 1} are in no report"
    return None


class DriftReport(Report):
    """Of `drift`: blocks of an input each, or of some of its intervals or skins. Rows come in the order of one run."""

    mark = "decant_drift"
    once = ("executor", "backend")
    lists = ("rows", "samples", "pour", "whole")  # groups with a row per list, or more

    def __init__(self, intervals: Sequence[int], skins: Sequence[float]):
        super().__init__()
        self.intervals = {n: k for k, n in enumerate(intervals)}
        self.skins = {float(s): k for k, s in enumerate(skins)}
        self.tables = {name: Table() for name in (*self.lists, "safe", "fixtures")}
        self.seen: set[tuple[str, bytes]] = set()
        self.fixtures: dict[bytes, int] = {}
        self.longest: list[int] = []

    def take(self, file: h5py.File) -> None:
        for name in self.lists:
            columns = self.tables[name].add(file[name])
            # Lists that no interval or skin has (auto, own) are in every block of an input, and count once.
            owned = columns["interval"] < 1
            known = np.array([(name, fixture) in self.seen for fixture in columns["fixture"]], bool)
            keep = ~(owned & known)
            self.seen |= {(name, fixture) for fixture in columns["fixture"][owned]}
            self.tables[name].parts[-1] = {key: values[keep] for key, values in columns.items()}
        self.tables["safe"].add(file["safe"])
        columns = self.tables["fixtures"].add(file["fixtures"])
        for fixture in columns["name"]:
            self.fixtures.setdefault(fixture, len(self.fixtures))
        rows = self.tables["rows"].parts[-1]
        fitted = rows["interval"][rows["skin"] == 0]
        self.longest += [int(fitted.max(initial=0))] * len(columns["name"])

    def put(self, out: h5py.File) -> None:
        out.attrs["backend"] = self.root["backend"]
        for name in self.lists:
            columns = self.tables[name].columns()
            order = sorted(range(len(columns["interval"])), key=lambda k, c=columns: self._place(c, k))
            self.tables[name].write(out, name, {key: values[order] for key, values in columns.items()})
        self.tables["safe"].write(out, "safe", self._safe())
        self.tables["fixtures"].write(out, "fixtures", self._once_each())

    def _place(self, columns: dict[str, np.ndarray], k: int) -> tuple[int, ...]:
        interval, skin = int(columns["interval"][k]), float(columns["skin"][k])
        fixture = self.fixtures.get(columns["fixture"][k], 0)
        if interval < 1:
            return fixture, 1, 0, 0
        return fixture, 0, self.skins.get(skin, len(self.skins)), self.intervals.get(interval, 0)

    def _safe(self) -> dict[str, np.ndarray]:
        """A block has seen lists as old as its longest interval: the shortest safe interval of all is the window's."""
        columns = self.tables["safe"].columns()
        rows: dict[tuple[int, float], dict[str, Any]] = {}
        for k in range(len(columns["skin"])):
            row = {name: values[k] for name, values in columns.items()}
            key = (self.fixtures[row["fixture"]], float(row["skin"]))
            known = rows.setdefault(key, row)
            for name in ("measured", "proved"):
                known[name] = min(known[name], row[name])
        return _of_rows(columns, [rows[key] for key in sorted(rows)])

    def _once_each(self) -> dict[str, np.ndarray]:
        """Powers are fitted to the longest interval without a skin: those of the block that has it. Seconds add up."""
        columns = self.tables["fixtures"].columns()
        rows: dict[bytes, tuple[int, dict[str, Any]]] = {}
        for k, longest in enumerate(self.longest):
            row = {name: values[k] for name, values in columns.items()}
            best, known = rows.get(row["name"], (-1, None))
            if known is not None:
                for name in ("measured_seconds", "run_seconds"):
                    row[name] = known[name] = known[name] + row[name]
            if longest > best:
                rows[row["name"]] = (longest, row)
        return _of_rows(columns, [rows[name][1] for name in self.fixtures])


class ValidationReport(Report):
    """Of `validate`, of cases that are in one report each."""

    mark = "decant_validation"
    once = ()

    def __init__(self) -> None:
        super().__init__()
        self.tables = {name: Table() for name in ("runs", "quantities", "orders")}
        self.curves: list[tuple[dict[str, Any], dict[str, tuple[np.ndarray, dict[str, Any]]]]] = []
        self.runs = 0

    def take(self, file: h5py.File) -> None:
        for name, table in self.tables.items():
            table.add(file[name])
        self.tables["quantities"].parts[-1]["run"] = self.tables["quantities"].parts[-1]["run"] + self.runs
        for name in sorted(file["curves"]):
            curve = file["curves"][name]
            attributes = dict(curve.attrs) | {"run": np.int64(curve.attrs["run"] + self.runs)}
            self.curves.append((attributes, {key: (data[:], dict(data.attrs)) for key, data in curve.items()}))
        self.runs += len(self.tables["runs"].parts[-1]["case"])

    def failed(self) -> int:
        """Gates that are not met."""
        return int((self.tables["quantities"].columns()["verdict"] == b"fail").sum())

    def put(self, out: h5py.File) -> None:
        for name, table in self.tables.items():
            table.write(out, name)
        curves = out.create_group("curves")
        for k, (attributes, columns) in enumerate(self.curves):
            made = curves.create_group(f"{k:04}")
            made.attrs.update(attributes)
            for name, (values, of) in columns.items():
                made.create_dataset(name, data=values).attrs.update(of)


def _of_rows(like: dict[str, np.ndarray], rows: list[dict[str, Any]]) -> dict[str, np.ndarray]:
    return {name: np.array([row[name] for row in rows], values.dtype) for name, values in like.items()}


def _said(value: Any) -> str:
    return value.decode() if isinstance(value, bytes) else str(value)
