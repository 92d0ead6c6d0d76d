"""The process of a Python port: python -m decant.serve FILE:CLASS OPTIONS, started by the command."""

from __future__ import annotations

import importlib
import importlib.util
import sys
import traceback
from pathlib import Path
from typing import Any

import numpy as np

from . import _decant
from .arrays import checked
from .model import COUNT_FIELDS, REAL_FIELDS, Given, State, Walls, field_shape
from .port import OFFERS, Port

SOCKET = 3


def class_called(name: str) -> type[Port]:
    """The class of FILE.py:CLASS, MODULE:CLASS or FILE.pickle:CLASS (by cloudpickle). Raises ImportError, TypeError."""
    where, _, what = name.rpartition(":")
    if where.endswith(".pickle"):
        import cloudpickle

        found = cloudpickle.loads(Path(where).read_bytes())
    else:
        if where.endswith(".py"):
            path = Path(where).resolve()
            if not path.is_file():
                raise ImportError(f"{where}: no such file")
            sys.path.insert(0, str(path.parent))
            spec = importlib.util.spec_from_file_location(path.stem, path)
            module = importlib.util.module_from_spec(spec)
            sys.modules[path.stem] = module
            spec.loader.exec_module(module)
        else:
            sys.path.insert(0, "")
            module = importlib.import_module(where)
        found = module
        for part in what.split("."):
            if not hasattr(found, part):
                raise ImportError(f"{where} has no {what}")
            found = getattr(found, part)
    if not (isinstance(found, type) and issubclass(found, Port)):
        raise TypeError(f"{what} is not derived from decant.Port")
    return found


class Served:
    """A port as _decant.serve calls it: NumPy arrays of the host, shapes checked."""

    def __init__(self, port: Port):
        unknown = set(port.offers) - set(OFFERS)
        if unknown:
            raise ValueError(f"offers: {', '.join(sorted(unknown))}; known are {', '.join(OFFERS)}")
        self._port = port
        self._fluid = self._walls = 0
        self.name = port.name or type(port).__name__
        self.precision = port.precision
        self.device = str(port.device)
        self.offers = sum(1 << bit for bit, offer in enumerate(OFFERS) if offer in port.offers)

    def load(self, scene: _decant.Scene, wall: Any, container: Any, position: Any, velocity: Any, substep: int) -> None:
        self._fluid, self._walls = len(position), len(wall)
        self.take_status()
        self._port.load(scene, Walls(wall, container), State(position, velocity, substep))

    def evaluate(self, boundary_volume: Any, density: Any, pressure: Any) -> dict[str, np.ndarray]:
        given = None
        if not all(v is None for v in (boundary_volume, density, pressure)):
            given = Given(boundary_volume, density, pressure)
        fields = self._port.evaluate(given)
        unknown = set(fields) - set(REAL_FIELDS) - set(COUNT_FIELDS)
        if unknown:
            raise ValueError(f"evaluate gives {', '.join(sorted(unknown))}, which is no field")
        return {
            name: checked(
                values,
                field_shape(name, self._fluid, self._walls),
                np.float64 if name in REAL_FIELDS else np.int64,
                name,
            )
            for name, values in fields.items()
        }

    def advance(self, substeps: int) -> None:
        self._port.advance(substeps)

    def read(self) -> tuple[np.ndarray, np.ndarray]:
        position, velocity = self._port.read()
        shape = (self._fluid, 3)
        return checked(position, shape, np.float64, "position"), checked(velocity, shape, np.float64, "velocity")

    def lists(self) -> tuple[Any, ...]:
        lists = self._port.lists()
        out = [int(lists.built)]
        for name in ("fluid", "wall"):
            offsets = checked(getattr(lists, name + "_offsets"), (self._fluid + 1,), np.int64, name + "_offsets")
            entries = getattr(lists, name)
            out += [offsets, checked(entries, (int(offsets[-1]),), np.int64, name)]
        return tuple(out)

    def stage_times(self) -> tuple[float, ...]:
        t = self._port.stage_times()
        return (t.build, t.build_calls, t.density, t.density_calls, t.force, t.force_calls, t.integrate,
                t.integrate_calls, t.rebuilds)  # fmt: skip

    def bytes(self) -> int:
        return int(self._port.bytes())

    def take_status(self) -> tuple[int, int, int]:
        reports = self._port.__dict__.pop("_reports", [])
        if not reports:
            return 0, -1, -1
        first = min(substep for substep, _, _ in reports)
        bits = 0
        for _, _, bit in reports:
            bits |= bit
        return bits, min(particle for substep, particle, _ in reports if substep == first), first

    def explain(self, error: BaseException) -> str:
        """One line: what was raised, and where in the port."""
        here = Path(__file__).parent
        frames = [f for f in traceback.extract_tb(error.__traceback__) if Path(f.filename).parent != here]
        where = f" ({Path(frames[-1].filename).name}:{frames[-1].lineno} in {frames[-1].name})" if frames else ""
        text = str(error).strip().splitlines()
        return f"{type(error).__name__}: {text[0] if text else ''}{where}"


def main() -> None:
    if len(sys.argv) != 3:
        sys.exit("decant.serve is started by the decant command")
    name, options = sys.argv[1:]
    pairs = [option.split("=", 1) for option in options.split(":") if option]

    def make() -> Served:
        try:
            return Served(class_called(name)(**dict(pairs)))
        except Exception as error:
            lines = str(error).strip().splitlines() or [""]
            raise RuntimeError(f"{type(error).__name__}: {lines[0]}") from None

    _decant.serve(SOCKET, make)


if __name__ == "__main__":
    main()
