"""Tests of the installed package: pytest tests/package, in an environment that has the wheel."""

import importlib.util
import os
import sys
from pathlib import Path

import pytest

pytest_plugins = ["pytester"]

EXAMPLES = Path(__file__).parents[2] / "tools/package/examples"
sys.path.insert(0, str(EXAMPLES))
sys.path.insert(0, str(Path(__file__).parent))

collect_ignore = [] if importlib.util.find_spec("warp") else ["test_warp.py"]


@pytest.fixture(scope="session")
def sequential(tmp_path_factory):
    """The first seed and the report of one run of the command, of seeds that only this session's processes name."""
    from campaigns import OPTIONS, everything

    import decant

    file = tmp_path_factory.mktemp("sequential") / "report.h5"
    seed = 1_000_000 + os.getpid() * 1000
    decant.command.run(["fuzz", *OPTIONS, "--seed", str(seed), "--report", str(file), "--quiet"])
    return seed, everything(file)
