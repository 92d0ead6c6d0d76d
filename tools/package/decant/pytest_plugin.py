"""The suite in a pytest run.

    @pytest.mark.decant(backend=MyPort)
    def test_conforms(decant_verdict):
        decant_verdict.require()

is one test per recording and check. The marker takes backend (a name or a class; default: --decant-backend), options,
recordings (names or files; default: the small ones that come with the package), checks and executor.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from .reports import Report, Row
from .reports import recordings as small_recordings
from .verbs import conform

CHECKS = (
    "fields", "substep", "contact", "advanced", "trajectory", "mass", "containment", "determinism", "conservation",
    "invariance", "status",
)  # fmt: skip

# Rows of the check `fields` carry the stage's name.
_STAGES = {"neighbors", "boundary_volume", "density", "pressure", "equation_of_state", "acceleration", "evaluation"}


@dataclass(frozen=True)
class Verdict:
    """What one check found on one recording."""

    recording: str
    check: str
    rows: list[Row]

    def require(self) -> None:
        """Fails the test with every failing row; skips it where nothing of the check is offered."""
        __tracebackhide__ = True
        failures = [row for row in self.rows if not row.passes and not row.left_out]
        if failures:
            pytest.fail("\n".join(map(str, failures)), pytrace=False)
        if not any(row.passes for row in self.rows):
            pytest.skip(f"{self.check}: not offered by the backend, or of no use on {self.recording}")


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("decant")
    group.addoption("--decant-backend", metavar="NAME", help="the backend to judge where the marker names none")
    parser.addini("decant_backend", "the backend to judge where marker and --decant-backend name none")


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line(
        "markers", "decant(backend, options, recordings, checks, executor): one test per recording and check"
    )
    config.stash[_reports] = {}


_reports: pytest.StashKey[dict[Any, Report]] = pytest.StashKey()


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    if "decant_verdict" not in metafunc.fixturenames:
        return
    marker = metafunc.definition.get_closest_marker("decant")
    wanted = dict(marker.kwargs) if marker else {}
    recordings = list(wanted.get("recordings") or small_recordings())
    checks = list(wanted.get("checks") or CHECKS)
    unknown = [c for c in checks if c not in CHECKS]
    if unknown:
        raise pytest.UsageError(f"decant: checks {', '.join(unknown)}; known are {', '.join(CHECKS)}")
    cases = [(str(r), c) for r in recordings for c in checks]
    names = [f"{Path(r).stem}-{c}" for r, c in cases]
    metafunc.parametrize("decant_verdict", cases, ids=names, indirect=True)


@pytest.fixture
def decant_verdict(request: pytest.FixtureRequest) -> Iterator[Verdict]:
    """Verdict of one check on one recording; each recording is run once, with all its checks."""
    recording, check = request.param
    marker = request.node.get_closest_marker("decant")
    wanted = dict(marker.kwargs) if marker else {}
    backend = wanted.get("backend") or request.config.getoption("--decant-backend")
    backend = backend or request.config.getini("decant_backend")
    if not backend:
        raise pytest.UsageError("decant: no backend in the marker, --decant-backend or the ini file's decant_backend")
    options, executor = wanted.get("options"), wanted.get("executor", "auto")
    checks = tuple(wanted.get("checks") or CHECKS)
    key = (backend, tuple((options or {}).items()), executor, recording, checks)
    reports = request.config.stash[_reports]
    if key not in reports:
        reports[key] = conform(recording, backend=backend, options=options, executor=executor, checks=checks)
    rows = [row for row in reports[key] if row.check == check or (check == "fields" and row.check in _STAGES)]
    yield Verdict(recording, check, rows + [row for row in reports[key] if row.check == "run"])
