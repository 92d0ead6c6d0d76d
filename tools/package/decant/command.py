"""The `decant` command that this package brings, and where its data are."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

PACKAGE = Path(__file__).resolve().parent
COMMAND = PACKAGE / "bin" / "decant"


def include_folder() -> Path:
    """Where plugin.h is: #include <decant/plugin.h> with it on the compiler's path."""
    return PACKAGE / "include"


def fixture_folder() -> Path:
    """The recordings that come with the package."""
    return PACKAGE / "share" / "decant" / "fixtures"


def scene_folder() -> Path:
    """The scenes that come with the package."""
    return fixture_folder() / "scenes"


def environment() -> dict[str, str]:
    """So that python:FILE:CLASS runs in this Python and finds the modules that this process finds."""
    found = os.pathsep.join(path or os.getcwd() for path in sys.path if not path.endswith(".zip"))
    return {"DECANT_PYTHON": sys.executable, **os.environ, "PYTHONPATH": found}


class CommandError(RuntimeError):
    """The command could not do what was asked: its exit status (tools/README.md) and its message."""

    def __init__(self, arguments: list[str], status: int, message: str):
        self.arguments, self.status, self.message = arguments, status, message
        super().__init__(message or f"decant {' '.join(arguments)} ended with status {status}")


def run(arguments: list[str], passes: tuple[int, ...] = (0,)) -> subprocess.CompletedProcess[str]:
    """Runs the command. Raises CommandError where it ends with another status than those of `passes`."""
    done = subprocess.run([str(COMMAND), *arguments], env=environment(), capture_output=True, text=True)
    if done.returncode not in passes:
        raise CommandError(arguments, done.returncode, done.stderr.strip() or done.stdout.strip())
    return done


def main() -> None:
    """The console script `decant`. Campaigns are this package's; every other verb is the command's."""
    if sys.argv[1:2] == ["campaign"]:
        from .campaign.command import main as run_campaign

        sys.exit(run_campaign(sys.argv[2:]))
    os.execve(COMMAND, [str(COMMAND), *sys.argv[1:]], environment())
