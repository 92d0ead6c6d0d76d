"""The command's verbs as functions: conform, fuzz, drift, bench, diff. They run it and read what it wrote."""

from __future__ import annotations

import contextlib
import inspect
import json
import os
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .command import CommandError, run
from .port import Port
from .reports import Report, read_columns, read_report, to_pandas

if TYPE_CHECKING:
    import numpy as np
    import pandas

#: a name ("hash", "list:skin=0.1", "plugin:./mine.so"), or a class derived from decant.Port
Backend = str | type[Port]
PathLike = str | os.PathLike[str]


@contextlib.contextmanager
def named(backend: Backend, options: Mapping[str, Any] | None = None) -> Iterator[str]:
    """What --backend takes: a class is found again by its file, or pickled by cloudpickle where it has none."""
    behind = "".join(f":{key}={value}" for key, value in (options or {}).items())
    if isinstance(backend, str):
        yield backend + behind
        return
    if not (isinstance(backend, type) and issubclass(backend, Port)):
        raise TypeError(f"backend: a name or a class derived from decant.Port, not {backend!r}")
    file = None
    with contextlib.suppress(TypeError, OSError):
        file = inspect.getsourcefile(backend)
    local = "<locals>" in backend.__qualname__
    if file and file.endswith(".py") and Path(file).is_file() and not local:
        yield f"python:{Path(file).resolve()}:{backend.__qualname__}{behind}"
        return
    try:
        import cloudpickle
    except ImportError:
        raise TypeError(
            f"{backend.__qualname__} is defined in no file or within a function: cloudpickle, which can send it to "
            "the process that judges it, is not installed"
        ) from None
    with tempfile.TemporaryDirectory() as folder:
        pickled = Path(folder) / "port.pickle"
        pickled.write_bytes(cloudpickle.dumps(backend))
        yield f"python:{pickled}:{backend.__name__}{behind}"


def _repeated(option: str, values: Sequence[Any] | Any | None) -> list[str]:
    if values is None:
        return []
    if isinstance(values, str) or not isinstance(values, Sequence):
        values = [values]
    return [option, ",".join(f"{v}" for v in values)] if values else []


@contextlib.contextmanager
def _oracle(oracle: Backend | None) -> Iterator[list[str]]:
    if oracle is None:
        yield []
        return
    with named(oracle) as choice:
        yield ["--oracle", choice]


@contextlib.contextmanager
def _report(file: PathLike | None, name: str) -> Iterator[Path]:
    """The file asked for, or one that goes when it has been read."""
    if file is not None:
        yield Path(file)
        return
    with tempfile.TemporaryDirectory() as folder:
        yield Path(folder) / name


def conform(
    *fixtures: PathLike,
    backend: Backend,
    options: Mapping[str, Any] | None = None,
    checks: Sequence[str] | str | None = None,
    executor: str = "auto",
    oracle: Backend | None = None,
    kernel: str | None = None,
    report: PathLike | None = None,
    reproducers: PathLike | None = None,
) -> Report:
    """Judges a backend on recordings (files or names; default: the small ones).

    checks: fields, substep, …; default: all. oracle: a solver in fp64 as the reference, with bounds that are measured;
    default: Decant's own. kernel: the recorded states with this kernel in place of their own. report: keeps the HDF5
    file. reproducers: a folder for small fixtures of failing particles.
    Returns a Report, failing rows included. Raises CommandError for bad input.
    """
    with named(backend, options) as choice, _oracle(oracle) as reference, _report(report, "conform.h5") as file:
        arguments = ["conform", *map(str, fixtures), "--backend", choice, "--executor", executor, *reference]
        arguments += _repeated("--kernel", kernel)
        arguments += [*_repeated("--check", checks), "--report", str(file), "--quiet"]
        if reproducers is not None:
            arguments += ["--reproducers", str(reproducers)]
        done = run(arguments, passes=(0, 1, 3))
        if not file.is_file():
            raise CommandError(arguments, done.returncode, done.stderr.strip() or done.stdout.strip())
        return read_report(file)


@dataclass(frozen=True)
class Campaign:
    """What `decant fuzz` found."""

    passes: bool
    text: str
    file: Path | None
    columns: dict[str, dict[str, np.ndarray]]  # groups of the report (oracle/formats/fuzz.md) with their columns

    def require(self) -> None:
        """Raises AssertionError with the counterexamples."""
        if not self.passes:
            raise AssertionError("\n" + self.text)


def fuzz(
    *,
    backend: Backend,
    options: Mapping[str, Any] | None = None,
    cases: int = 50,
    seed: int | None = None,
    executor: str = "auto",
    failures: PathLike | None = None,
    report: PathLike | None = None,
) -> Campaign:
    """Property-based tests on random scenes; counterexamples are minimised, and saved in the folder `failures`."""
    with named(backend, options) as choice, _report(report, "fuzz.h5") as file, _report(failures, "found") as found:
        arguments = ["fuzz", "--backend", choice, "--executor", executor, "--cases", str(cases)]
        arguments += ["--report", str(file), "--failures", str(found), "--quiet"]
        if seed is not None:
            arguments += ["--seed", str(seed)]
        done = run(arguments, passes=(0, 1))
        columns = _groups(file)
        return Campaign(done.returncode == 0, done.stdout.strip(), Path(report) if report else None, columns)


def _groups(file: Path) -> dict[str, dict[str, np.ndarray]]:
    import h5py

    with h5py.File(file) as opened:
        groups = [name for name, item in opened.items() if isinstance(item, h5py.Group) and name != "provenance"]
    return {name: read_columns(file, name) for name in groups}


@dataclass(frozen=True)
class Drift:
    """What `decant drift` measured."""

    text: str  # its tables
    rows: dict[str, np.ndarray]  # one window and list per row (oracle/formats/drift.md)
    file: Path | None

    def to_pandas(self) -> pandas.DataFrame:
        """One line per row; needs pandas."""
        import pandas

        return pandas.DataFrame(self.rows)


def drift(
    *inputs: PathLike,
    backend: Backend = "list",
    options: Mapping[str, Any] | None = None,
    intervals: Sequence[int] | None = None,
    skins: Sequence[float] | None = None,
    window: int | None = None,
    executor: str = "auto",
    report: PathLike | None = None,
) -> Drift:
    """What neighbor lists miss that are rebuilt every N substeps (intervals), with a skin (shares of H)."""
    with named(backend, options) as choice, _report(report, "drift.h5") as file:
        arguments = ["drift", *map(str, inputs), "--backend", choice, "--executor", executor, "--report", str(file)]
        arguments += [*_repeated("--intervals", intervals), *_repeated("--skins", skins), "--quiet"]
        if window is not None:
            arguments += ["--window", str(window)]
        done = run(arguments)
        return Drift(done.stdout.strip(), read_columns(file, "rows"), Path(report) if report else None)


def bench(*fixtures: PathLike, backend: Backend, options: Mapping[str, Any] | None = None,
          executor: str = "auto", more: Sequence[str] = ()) -> dict[str, Any]:  # fmt: skip
    """Times per substep, calls included, of a backend that conforms: the command's JSON. more: its other options."""
    with named(backend, options) as choice:
        done = run(["bench", *map(str, fixtures), "--backend", choice, "--executor", executor, "--json", *more])
        return json.loads(done.stdout)


def diff(before: PathLike, after: PathLike) -> tuple[bool, str]:
    """Whether no row of the second report is worse than in the first, and what differs, in words."""
    done = run(["diff", str(before), str(after)], passes=(0, 1))
    return done.returncode == 0, done.stdout.strip()


__all__ = ["Backend", "Campaign", "Drift", "bench", "conform", "diff", "drift", "fuzz", "read_report", "to_pandas"]
