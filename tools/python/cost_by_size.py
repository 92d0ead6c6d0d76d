#!/usr/bin/env python3
"""Measures what a substep costs as the same scene grows: time and device memory per particle, by backend.

    cost_by_size.py FOLDER

A size is a recording whose particles `decant bench --refine K` replaces by eight each, K times, which halves the
spacing K times; the backend that is timed first settles them. Recordings are of one scene, and differ in the particle
spacing alone. What each row is made of is in FOLDER/size.h5. Runs are kept in FOLDER/runs, and not run again; a size
that the device has no memory for is kept as such. Pictures: plot_study.py. Exit status: 0 all is there, 3 something
is missing (--seconds ran out, or a run failed).
"""

import argparse
import hashlib
import json
import re
import subprocess
import time
from pathlib import Path

import h5py
import numpy as np

from one_line import read_text, refuse, run_main
from study_runs import ROOT, about, keep, last_line, name_of, plain, recording, run, write_table

# Recordings and K. The sizes that are reported first, each by some eight times larger; then those between them.
SIZES = [("pour-4k-filling", 0), ("pour-56k-filling", 0), ("pour-56k-filling", 1), ("pour-56k-filling", 2),
         ("pour-4k-filling", 4), ("pour-56k-filling", 3), ("pour-12k-filling", 4),
         ("pour-4k-filling", 1), ("pour-12k-filling", 0), ("pour-12k-filling", 1), ("pour-4k-filling", 2),
         ("pour-12k-filling", 2), ("pour-4k-filling", 3), ("pour-12k-filling", 3)]
# Recorded here, at the same phase, since fixtures/ has none from which 50 million particles are made.
SCENE, PHASE, SPACINGS = "pour-4k", "filling", {"pour-12k-filling": 0.00271}
BACKENDS = ["list", "hash", "brute"]
SETTLER = "list"  # the fastest
# From here on windows have so many substeps: a tenth of a second would be too few rebuilds of a list.
LARGE, LARGE_SUBSTEPS = 1_000_000, 64
ONE_WINDOW = 10_000_000  # and from here on one window, since each loads the state again, which takes longer than it
NO_MEMORY = re.compile(r"out of memory|bad_alloc|MemoryAllocation", re.IGNORECASE)
UNITS = {"particle_spacing": "m", "substep_us": "us", "fastest_us": "us", "slowest_us": "us",
         "time_per_particle": "ns", "device_bytes_per_particle": "byte", "build_us": "us", "density_us": "us",
         "force_us": "us", "integrate_us": "us", "other_us": "us"}
MEASURED = ("wall_particles", "substeps", "substep_us", "fastest_us", "slowest_us", "device_bytes_per_particle",
            "neighbors_mean", "substeps_per_rebuild")


def record(name, arguments):
    """A recording of the scene at another spacing; made once."""
    file = arguments.folder / f"{name}.h5"
    if not file.is_file():
        scene = arguments.folder / f"{name.removesuffix('-' + PHASE)}.json"
        text = read_text(ROOT / "fixtures" / "scenes" / f"{SCENE}.json", "a scene")
        for key, value in (("particle_spacing", SPACINGS[name]), ("name", json.dumps(scene.stem))):
            text, found = re.subn(rf'("{key}":) [^,]*,', rf"\1 {value},", text, count=1)
            if not found:
                refuse(f"{SCENE}.json: no {key}")
        keep(scene, text)
        run([arguments.decant, "record", scene, "--backend", SETTLER, "--executor", arguments.executor, "--sample",
             "--quiet", "--phase", PHASE, "--ensemble-substeps", "1", "--ensemble-members", "2", "--out", file])
    return file


class Size:
    """A recording, and how often its particles are replaced by eight."""

    def __init__(self, name, refine, arguments):
        made_here = name in SPACINGS and not (ROOT / "fixtures" / f"{name}.h5").is_file()
        self.file = record(name, arguments) if made_here else recording(name)
        with h5py.File(self.file) as file:
            particles = len(file["state/position"])
            spacing = json.loads(file["scene"].asstr()[()])["particle_spacing"]
        self.particles = particles * 8**refine
        self.about = {"recording": self.file.stem, "refined": refine, "particles": self.particles,
                      "particle_spacing": spacing / 2**refine, "recorded_particles": particles,
                      "windows": arguments.windows if self.particles < ONE_WINDOW else 1,
                      "recording_sha256": hashlib.sha256(self.file.read_bytes()).hexdigest()}
        self.runs = arguments.folder / "runs" / f"size-{arguments.executor}-{self.file.stem}-{refine}"

    def rule(self, settled_by):
        if self.about["refined"] == 0:
            return f"recording {self.about['recording']}"
        return (f"recording {self.about['recording']}, {self.about['refined']} × eight particles for one, "
                f"settled by {settled_by}")

    def run_file(self, backend):
        return self.runs.with_name(f"{self.runs.name}-{plain(backend)}.json")


def bench(size, backends, arguments):
    """Rows by backend, their provenance, and what was said of the others. The first backend settles the particles."""
    substeps = ["--substeps", str(LARGE_SUBSTEPS)] if size.particles >= LARGE and "brute" not in backends else []
    done = subprocess.run([arguments.decant, "bench", size.file, "--refine", str(size.about["refined"]), "--backend",
                           ",".join(backends), "--executor", arguments.executor, "--windows",
                           str(size.about["windows"]), *substeps, "--json"], capture_output=True, text=True)
    try:
        found = json.loads(done.stdout)
    except ValueError:
        found = {"rows": [], "provenance": {}}
    said = "out of memory: the system ended the run" if done.returncode == -9 else done.stderr
    return {name_of(row): row for row in found["rows"]}, found["provenance"], said


def keep_run(size, backend, outcome, settled_by, row, provenance):
    keep(size.run_file(backend), json.dumps({
        "backend": backend, "outcome": outcome, "rule": size.rule(settled_by), **size.about, "row": row,
        "provenance": provenance}, indent=1, ensure_ascii=False))


def reason(said):
    """The line that says why a backend was not timed."""
    return last_line("\n".join(re.findall(r"^.*not timed.*$|^decant: .*$", said, re.MULTILINE)) or said)


def measure(size, backends, arguments):
    """Times the backends in one call, so that all see the same particles, and keeps a run of each."""
    called = backends if not size.about["refined"] or SETTLER in backends else [SETTLER, *backends]
    rows, provenance, said = bench(size, called, arguments)
    for backend in backends:
        row, of, why, settled_by = rows.get(backend), provenance, said, called[0]
        if row is None and len(called) > 1 and NO_MEMORY.search(said):  # it may fit alone
            alone, of, why = bench(size, [backend], arguments)
            row, settled_by = alone.get(backend), backend
        if row:
            keep_run(size, backend, "timed", settled_by, row, of)
            told = (f"{row['substep_us']:.4g} µs per substep, {1000 * row['substep_us'] / row['particles']:.3g} ns and "
                    f"{row['device_bytes_per_particle']:.0f} bytes per particle")
        elif NO_MEMORY.search(why):
            keep_run(size, backend, "does not fit", settled_by, None, of or arguments.build)
            told = f"does not fit: {reason(why)}"
        else:
            told = f"failed: {reason(why)}"
        print(f"{size.particles:>12,}  {backend}: {told}", flush=True)


def kept_runs(arguments):
    files = (arguments.folder / "runs").glob(f"size-{arguments.executor}-*.json")
    runs = [json.loads(file.read_text(encoding="utf-8")) for file in files]
    return sorted(runs, key=lambda run: (run["particles"], run["backend"]))


def seconds_of_brute(size, arguments):
    """Of a substep, by the square of the size, from the largest one measured; None where none is."""
    measured = [run["row"] for run in kept_runs(arguments) if run["backend"] == "brute" and run["row"]]
    if not measured:
        return None
    return 1e-6 * measured[-1]["substep_us"] * (size.particles / measured[-1]["particles"]) ** 2


def left_out(size, backend, arguments):
    """Why a backend is not timed at a size; empty where it is."""
    if size.particles > arguments.most_particles:
        return f"more than {arguments.most_particles:,.0f} particles"
    if backend != "brute" or size.about["refined"] == 0:
        return ""
    seconds = seconds_of_brute(size, arguments)
    if seconds is None:
        return "no smaller size says how long it would take"
    return f"a substep would take {seconds:.1f} s" if seconds > arguments.brute_seconds else ""


def gather(arguments):
    """One row per size and backend."""
    runs = kept_runs(arguments)
    if not runs:
        return
    rows = [run["row"] or {} for run in runs]
    columns = {name: [run[name] for run in runs] for name in (
        "backend", "outcome", "rule", "recording", "refined", "particles", "particle_spacing", "recorded_particles",
        "recording_sha256", "windows")}
    columns |= {name: [float(row.get(name, np.nan)) for row in rows] for name in MEASURED}
    columns["time_per_particle"] = [1000 * row.get("substep_us", np.nan) / run["particles"]
                                    for row, run in zip(rows, runs)]
    columns |= {f"{stage}_us": [float((row.get("stages_us") or {}).get(stage, np.nan)) for row in rows]
                for stage in ("build", "density", "force", "integrate", "other")}
    columns |= {"device": [row.get("device", "") for row in rows],
                "git_revision": [run["provenance"].get("git_revision", "") for run in runs]}
    write_table(arguments.folder / "size.h5", "decant_cost_by_size", columns, UNITS, arguments.build)


def parse_size(text):
    name, _, refine = text.rpartition(":")
    if not name or refine not in "01234":
        refuse(f"--size {text}: RECORDING:K, K from 0 to 4")
    return name, int(refine)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--size", action="append", metavar="RECORDING:K", help="may be repeated; default: 4 thousand "
                        "to 50 million particles of one pour while it fills")
    parser.add_argument("--backend", action="append", help=f"may be repeated; default: {', '.join(BACKENDS)}")
    parser.add_argument("--executor", choices=("cuda", "host"), default="cuda")
    parser.add_argument("--windows", type=int, default=3, help="the median of so many counts; default: 3, of more "
                        "than 10 million particles one")
    parser.add_argument("--most-particles", type=float, default=60e6, help="larger sizes are left out; default: 60e6")
    parser.add_argument("--brute-seconds", type=float, default=1, help="brute is left out where a substep would take "
                        "longer; default: 1")
    parser.add_argument("--decant", default="build/release/bin/decant")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="start nothing after so long")
    arguments = parser.parse_args()
    start = time.monotonic()
    (arguments.folder / "runs").mkdir(parents=True, exist_ok=True)
    arguments.build = about(arguments.decant, arguments.executor)
    backends = arguments.backend or BACKENDS
    missing = 0
    for name, refine in map(parse_size, arguments.size) if arguments.size else SIZES:
        if time.monotonic() - start > arguments.seconds:
            missing += len(backends)
            continue
        size = Size(name, refine, arguments)
        pending = [b for b in backends if not size.run_file(b).is_file()]
        # brute has windows of its own, of few substeps.
        for group in ([b for b in pending if b != "brute"], [b for b in pending if b == "brute"]):
            whys = {b: left_out(size, b, arguments) for b in group}
            for backend in filter(whys.get, group):
                print(f"{size.particles:>12,}  {backend}: left out: {whys[backend]}", flush=True)
            group = [b for b in group if not whys[b]]
            if group and time.monotonic() - start < arguments.seconds:
                measure(size, group, arguments)
            missing += sum(not size.run_file(b).is_file() for b in group)
    gather(arguments)
    print(f"{arguments.folder / 'size.h5'}, {time.monotonic() - start:.0f} s"
          + (f"; {missing} runs are missing, the same command goes on" if missing else ""))
    return 3 if missing else 0


if __name__ == "__main__":
    run_main(main)
