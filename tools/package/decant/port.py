"""The class that a port is derived from."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from .model import Given, Lists, Scene, StageTimes, State, Walls

# In the order of decant_offer (plugin.h).
OFFERS = (
    "density",
    "acceleration",
    "parts",
    "neighbors",
    "given",
    "boundary_volume",
    "walls",
    "step",
    "status",
    "lists",
    "rebuild",
)
STATUS_BITS = {"non_finite": 1, "escaped": 2, "capacity": 4, "missed_pair": 8}


class Port:
    """A solver to be judged: derive from it, and name the class where a backend is named.

        decant conform --backend python:my_port.py:MyPort

    Arrays that it returns may be of any library that speaks DLPack or __array__, on any device, of fp32 or fp64.
    It runs in a Python process of its own: a crash or a call without end is a failing row.
    """

    #: what it can be asked for, of OFFERS; checks that need more are left out and named
    offers: ClassVar[set[str]] = {"density", "acceleration", "walls", "step"}
    #: for reports; None: the class's name
    name: ClassVar[str | None] = None
    precision: ClassVar[str] = "fp32"
    device: str = "host"

    def __init__(self, **options: str):
        """options: what stood behind the class, key=value. Raise ValueError for those that you do not know."""
        if options:
            raise ValueError(f"{type(self).__name__} knows no option {next(iter(options))}")

    def load(self, scene: Scene, walls: Walls, state: State) -> None:
        """Takes a scene and a state; comes again and again, with others."""
        raise NotImplementedError

    def evaluate(self, given: Given | None) -> Mapping[str, Any]:
        """Fields at the present state, by name (REAL_FIELDS, COUNT_FIELDS); what is missing counts as not written.

        A particle is not its own neighbor; pairs count where r < H. No later call may differ because of this one.
        """
        raise NotImplementedError

    def advance(self, substeps: int) -> None:
        """So many substeps of scene.time_step onward. Say what goes wrong by self.report()."""
        raise NotImplementedError

    def read(self) -> tuple[Any, Any]:
        """Positions [n,3], m, and velocities [n,3], m/s."""
        raise NotImplementedError

    def lists(self) -> Lists:
        """The lists that the next substep uses; for the offer `lists`."""
        raise NotImplementedError

    def stage_times(self) -> StageTimes:
        """Since load; all zero where nothing is timed."""
        return StageTimes()

    def bytes(self) -> int:
        """Memory held on a device; 0: not told."""
        return 0

    def report(self, what: str, particle: int, substep: int) -> None:
        """Tells of trouble during evaluate or advance; for the offer `status`.

        what: non_finite, escaped, capacity or missed_pair; particle: the lowest id concerned; substep: the first one
        after which it was seen, counted as state.substep counts.
        """
        if what not in STATUS_BITS:
            raise ValueError(f"report: {what!r} is none of {', '.join(STATUS_BITS)}")
        reports = self.__dict__.setdefault("_reports", [])
        reports.append((int(substep), int(particle), STATUS_BITS[what]))
