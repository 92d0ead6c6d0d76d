"""Reports as Python objects and as tables. The layouts are in oracle/formats/."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

if TYPE_CHECKING:
    import pandas


def _text(value: Any) -> str:
    return value.decode() if isinstance(value, bytes) else str(value)


def _column(data: h5py.Dataset) -> np.ndarray:
    values = data[:]
    return np.array([_text(v) for v in values], dtype=object) if values.dtype.kind in "SO" else values


def read_columns(file: str | Path, group: str) -> dict[str, np.ndarray]:
    """The one-dimensional columns of a group of any report of Decant, by name."""
    with h5py.File(file) as opened:
        return {name: _column(data) for name, data in opened[group].items() if isinstance(data, h5py.Dataset)}


def to_pandas(file: str | Path, group: str) -> pandas.DataFrame:
    """The same as a DataFrame; needs pandas. Groups: summary of conform; rows, samples, safe of drift; …"""
    import pandas

    return pandas.DataFrame(read_columns(file, group))


@dataclass(frozen=True)
class Row:
    """One field of one check of one backend on one recording; names and units as in oracle/formats/report.md."""

    backend: str
    fixture: str
    check: str
    field: str
    verdict: str  # pass, fail or not_run
    reason: str  # why not a pass
    unit: str
    n: int  # values compared
    error: float  # largest |error|, in the unit
    tolerance: float  # that value's own
    score: float  # largest |error| / tolerance; up to 1 passes
    median_score: float
    fp32_reference_score: float  # of the oracle's source in sequential fp32
    worst_id: int  # particle; -1: none
    worst_component: int  # 0, 1, 2: x, y, z; -1: none, or a tensor, whose entry the reason names
    actual: float
    expected: float
    worst_x: float  # m
    worst_y: float
    worst_z: float
    fluid_neighbors: int  # of the worst particle; -1: none
    wall_neighbors: int
    nearest: str  # ids of its nearest neighbors

    @property
    def passes(self) -> bool:
        return self.verdict == "pass"

    @property
    def left_out(self) -> bool:
        """The backend does not offer what this row needs."""
        return self.verdict == "not_run" and self.reason.startswith("not offered")

    def __str__(self) -> str:
        where = f"{self.backend} on {self.fixture}: {self.check} / {self.field}"
        if self.passes:
            return f"{where}: pass, score {self.score:.3g}"
        lines = [f"{where}: {self.verdict}" + (f", {self.reason}" if self.reason else "")]
        if self.worst_id >= 0:
            component = "" if self.worst_component < 0 else " " + "xyz"[self.worst_component]
            lines += [
                f"  particle {self.worst_id}{component}: actual {self.actual:.9g}, expected {self.expected:.9g} "
                f"{self.unit}",
                f"  error {self.error:.4g}, tolerance {self.tolerance:.4g} {self.unit}, score {self.score:.3g}; "
                f"median score {self.median_score:.3g}",
            ]
        if self.worst_x == self.worst_x:
            place = f"  at ({self.worst_x:.6g}, {self.worst_y:.6g}, {self.worst_z:.6g}) m"
            around = f", {self.fluid_neighbors} fluid and {self.wall_neighbors} wall neighbors"
            near = f"; nearest {self.nearest or 'none'}"
            lines.append(place + (around + near if self.fluid_neighbors >= 0 else ""))
        return "\n".join(lines)


_COLUMNS = tuple(Row.__dataclass_fields__)


@dataclass(frozen=True)
class Report:
    """What `decant conform` found."""

    verdict: str  # of the whole
    rows: list[Row] = field(repr=False)
    provenance: dict[str, str] = field(repr=False)
    file: Path | None = None

    def __iter__(self) -> Iterator[Row]:
        return iter(self.rows)

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def failures(self) -> list[Row]:
        """Rows that do not pass, those of what is not offered left out."""
        return [row for row in self.rows if not row.passes and not row.left_out]

    @property
    def left_out(self) -> list[Row]:
        """Rows that need what the backend does not offer."""
        return [row for row in self.rows if row.left_out]

    @property
    def passes(self) -> bool:
        """All that was judged passes, and something was."""
        return not self.failures and any(row.passes for row in self.rows)

    def require(self) -> None:
        """Raises AssertionError that shows every failing row."""
        if not self.passes:
            raise AssertionError("\n" + ("\n".join(map(str, self.failures)) or "nothing was judged"))

    def to_pandas(self) -> pandas.DataFrame:
        """One line per row; needs pandas."""
        import pandas

        lines = [{name: getattr(row, name) for name in _COLUMNS} for row in self.rows]
        return pandas.DataFrame(lines, columns=_COLUMNS)

    def __str__(self) -> str:
        judged = len(self.rows) - len(self.left_out)
        head = f"{'pass' if self.passes else 'fail'}: {judged} rows judged, {len(self.failures)} fail"
        if self.left_out:
            head += f", {len(self.left_out)} need what is not offered"
        return "\n".join([head, *map(str, self.failures)])


def read_report(file: str | Path) -> Report:
    """A report of `decant conform` (schema 3). Raises ValueError where it is none."""
    with h5py.File(file) as opened:
        schema = opened.attrs.get("decant_report")
        if schema != 3:
            raise ValueError(f"{file}: decant_report is {schema}; 3 is read")
        columns = {name: _column(opened["summary"][name]) for name in _COLUMNS}
        provenance = {name: _text(value) for name, value in opened["provenance"].attrs.items()}
        verdict = _text(opened.attrs["verdict"])
    rows = []
    for k in range(len(columns["check"])):
        values = {name: column[k] for name, column in columns.items()}
        rows.append(Row(**{name: v.item() if isinstance(v, np.generic) else v for name, v in values.items()}))
    return Report(verdict, rows, provenance, Path(file))


@dataclass(frozen=True)
class Fixture:
    """A recorded state with the oracle's fields (oracle/formats/fixture.md)."""

    name: str
    scene: Any  # decant.Scene
    state: Any  # decant.State
    fields: dict[str, np.ndarray]  # by name; empty in study-scale recordings


def read_fixture(name: str | Path) -> Fixture:
    """A recording, by file or by the name of one that comes with the package. Raises FileNotFoundError."""
    from .command import fixture_folder
    from .model import COUNT_FIELDS, REAL_FIELDS, Scene, State

    path = Path(name)
    if not path.is_file():
        path = fixture_folder() / f"{path.name.removesuffix('.h5')}.h5"
    if not path.is_file():
        raise FileNotFoundError(f"{name}: no such file, and no recording of that name in {fixture_folder()}")
    with h5py.File(path) as opened:
        scene = Scene.parse(_text(opened["scene"][()]), str(path))
        state = State(opened["state/position"][:], opened["state/velocity"][:], int(opened["state"].attrs["substep"]))
        fields = {n: opened["oracle"][n][:] for n in (*REAL_FIELDS, *COUNT_FIELDS) if "oracle" in opened}
    return Fixture(path.stem, scene, state, fields)


def recordings() -> list[str]:
    """Names of the small recordings that come with the package: those that hold all of the oracle's fields."""
    from .command import fixture_folder

    names = []
    for file in sorted(fixture_folder().glob("*.h5")):
        with h5py.File(file) as opened:
            if "oracle" in opened:
                names.append(file.stem)
    return names
