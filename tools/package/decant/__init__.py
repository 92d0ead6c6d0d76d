"""Decant judges ports of a particle fluid solver (SPH) against a sequential oracle in double precision.

A port is a class derived from Port; conform, fuzz, drift, bench and diff are the command's verbs.

    import decant

    class MyPort(decant.Port): ...

    decant.conform(backend=MyPort).require()
"""

from ._decant import BackendError, InputError, Scene
from .arrays import on_host
from .command import CommandError, fixture_folder, include_folder, scene_folder
from .model import (
    COUNT_FIELDS,
    REAL_FIELDS,
    Given,
    Lists,
    Oracle,
    Pose,
    StageTimes,
    State,
    Walls,
)
from .port import OFFERS, Port
from .reports import Fixture, Report, Row, read_columns, read_fixture, read_report, recordings, to_pandas
from .verbs import Campaign, Drift, bench, conform, diff, drift, fuzz

__all__ = [
    "COUNT_FIELDS", "OFFERS", "REAL_FIELDS", "BackendError", "Campaign", "CommandError", "Drift", "Fixture", "Given",
    "InputError", "Lists", "Oracle", "Port", "Pose", "Report", "Row", "Scene", "StageTimes", "State", "Walls",
    "bench", "conform", "diff", "drift", "fixture_folder", "fuzz", "include_folder", "on_host", "read_columns",
    "read_fixture", "read_report", "recordings", "scene_folder", "to_pandas",
]  # fmt: skip
