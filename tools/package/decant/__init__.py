"""Decant judges ports of a particle fluid solver (SPH) against a sequential oracle in double precision.

A port is a class derived from Port; conform, fuzz, drift, bench and diff are the command's verbs.

    import decant

    class MyPort(decant.Port): ...

    decant.conform(backend=MyPort).require()
"""

from . import campaign
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
from .own import Bound, OwnVerdict, cut_out, diagnose, judge, spread
from .port import OFFERS, Port
from .properties import Property, kernel_properties, properties, repels
from .reports import Fixture, Report, Row, read_columns, read_fixture, read_report, recordings, to_pandas
from .results_file import field, near_cutoff, pair_sums, write_reference, write_results
from .verbs import Campaign, Drift, bench, conform, diff, drift, fuzz

__all__ = [
    "COUNT_FIELDS", "OFFERS", "REAL_FIELDS", "BackendError", "Bound", "Campaign", "CommandError", "Drift", "Fixture",
    "Given", "InputError", "Lists", "Oracle", "OwnVerdict", "Port", "Pose", "Property", "Report", "Row", "Scene",
    "StageTimes", "State", "Walls", "bench", "campaign", "conform", "cut_out", "diagnose", "diff", "drift", "field",
    "fixture_folder", "fuzz", "include_folder", "judge", "kernel_properties", "near_cutoff", "on_host", "pair_sums",
    "properties", "read_columns", "read_fixture", "read_report", "recordings", "repels", "scene_folder", "spread",
    "to_pandas", "write_reference", "write_results",
]  # fmt: skip
