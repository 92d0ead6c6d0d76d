"""Ends a script with one line and exit status 2 where its input is missing or not what it should be."""

import json
import sys
from pathlib import Path


def refuse(text):
    print(f"{Path(sys.argv[0]).name}: {' '.join(str(text).split())}", file=sys.stderr)
    sys.exit(2)


def need_file(path, what):
    """Refuses a path that is no file; `what` was expected there."""
    if Path(path).is_dir():
        refuse(f"{path}: a folder, not {what}")
    if not Path(path).exists():
        refuse(f"{path}: no such file; {what} is needed")


def open_hdf5(path, marks, what):
    """The file, open to read. Refused where it is not `what`: where none of `marks` is an attribute of its root."""
    import h5py  # here: not every script that ends in one line needs it

    need_file(path, what)
    try:
        file = h5py.File(path, "r")
    except OSError as error:
        refuse(f"{path}: not {what}, or cut off: {error}")
    if not any(mark in file.attrs for mark in marks):
        refuse(f"{path}: not {what}")
    return file


def read_text(path, what):
    need_file(path, what)
    try:
        return Path(path).read_text(encoding="utf-8")
    except UnicodeDecodeError:
        refuse(f"{path}: not {what}: no text")


def read_json(path, key, kind, what):
    """The object in a JSON file. Refused where it is not `what`: where it has no value of this kind for the key."""
    try:
        found = json.loads(read_text(path, what))
    except ValueError as error:
        refuse(f"{path}: not {what}, or cut off: {error}")
    if not isinstance(found, dict) or not isinstance(found.get(key), kind):
        refuse(f"{path}: not {what}")
    return found


def run_main(main):
    """Calls main() and ends with its status. A file that is not there, cannot be decoded or lacks something, and a
    text that main() exits with, are bad input."""
    try:
        status = main()
    except KeyError as error:
        said = str(error.args[0])  # h5py says a sentence, a dictionary the key alone
        refuse(said if " " in said else f"the input has no '{said}'")
    except (OSError, UnicodeDecodeError) as error:
        refuse(error)
    except SystemExit as end:
        if not isinstance(end.code, str):
            raise
        refuse(end.code)
    sys.exit(status)
