"""What the tools that repeat the published study share: runs of the command, files that appear whole or not at all, and
tables of what was measured."""

import json
import os
import re
import signal
import subprocess
from pathlib import Path

import h5py
import numpy as np

from one_line import refuse

ROOT = Path(__file__).resolve().parents[2]


def plain(name):
    return re.sub(r"[^A-Za-z0-9.=_-]", "-", name)


def last_line(text):
    return (text.strip().splitlines() or ["it said nothing"])[-1]


def run(command):
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        refuse(f"{' '.join(map(str, command[:3]))} …: {last_line(done.stderr or done.stdout)}")
    return done.stdout


def run_for(command, seconds):
    """Runs a command that ends early, and keeps what it has, where it is told to: after so many seconds."""
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        out, err = process.communicate(timeout=None if seconds == float("inf") else max(seconds, 1))
    except subprocess.TimeoutExpired:
        process.send_signal(signal.SIGTERM)
        out, err = process.communicate()
    return subprocess.CompletedProcess(command, process.returncode, out, err)


def keep(file, text):
    aside = file.with_suffix(".part")
    aside.write_text(text, encoding="utf-8")
    aside.replace(file)


def name_of(row):
    """Of a row of `bench`: as --backend takes it."""
    return row["backend"] + (f":{row['options']}" if row["options"] else "")


def about(decant, executor):
    """What `info` says of the build, and the executor's device."""
    info = json.loads(run([decant, "info", "--json"]))
    device = next((e["device"] for e in info["executors"] if e["name"] == executor and e["available"]), None)
    if device is None:
        refuse(f"no device here for the executor {executor}")
    kept = ("version", "git_revision", "compiler", "flags", "build_type")
    return {"device": device, **{key: str(info[key]) for key in kept}}


def recording(name):
    """The file of a recording given by its path, or by its name in fixtures/."""
    for file in (Path(name), ROOT / "fixtures" / f"{name}.h5"):
        if file.is_file():
            return file
    refuse(f"{name}: no recording, neither a file nor one of fixtures/")


def add_columns(group, columns, units):
    for name, values in columns.items():
        if values and isinstance(values[0], str):
            group[name] = np.array([value.encode() for value in values])
            continue
        group.create_dataset(name, data=np.array(values), compression="gzip", shuffle=True)
        group[name].attrs["unit"] = np.bytes_(units.get(name, "1"))


def write_table(file, mark, columns, units, provenance, groups=None):
    """One file of columns; `mark` says what it is, `groups` holds further columns by the group's name."""
    aside = file.with_name(f".{file.name}.{os.getpid()}")
    with h5py.File(aside, "w", libver="v108") as out:
        out.attrs[mark] = np.int64(1)
        attributes = out.create_group("provenance").attrs
        for key, value in provenance.items():
            attributes[key] = np.bytes_(value.encode())
        add_columns(out, columns, units)
        for name, more in (groups or {}).items():
            add_columns(out.create_group(name), more, units)
    aside.replace(file)


def columns_of(group):
    """The columns of a group, text as text."""
    found = {name: item[:] for name, item in group.items() if isinstance(item, h5py.Dataset)}
    return {name: np.char.decode(c, "utf-8") if c.dtype.kind == "S" else c for name, c in found.items()}


def provenance_of(file):
    return {name: value.decode() for name, value in file["provenance"].attrs.items()}
