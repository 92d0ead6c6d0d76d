"""Ends a script with one line where its input is missing or not what it should be."""

import sys
from pathlib import Path


def run_main(main):
    """Calls main() and ends with its status; a file that is not there or lacks something is told in one line."""
    try:
        sys.exit(main())
    except (OSError, KeyError) as error:
        sys.exit(f"{Path(sys.argv[0]).name}: {error.args[0] if isinstance(error, KeyError) else error}")
