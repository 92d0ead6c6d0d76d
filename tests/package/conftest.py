"""Tests of the installed package: pytest tests/package, in an environment that has the wheel."""

import importlib.util
import sys
from pathlib import Path

pytest_plugins = ["pytester"]

EXAMPLES = Path(__file__).parents[2] / "tools/package/examples"
sys.path.insert(0, str(EXAMPLES))
sys.path.insert(0, str(Path(__file__).parent))

collect_ignore = [] if importlib.util.find_spec("warp") else ["test_warp.py"]
