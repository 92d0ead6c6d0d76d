"""Lets scripts import parts of the Python package from the source tree, where its compiled part is not built."""

import sys
import types
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def campaign_package():
    """Makes `import decant.campaign` find the sources: decant/__init__.py is not run, which needs the compiled part."""
    package = types.ModuleType("decant")
    package.__path__ = [str(ROOT / "tools" / "package" / "decant")]
    sys.modules["decant"] = package
