#!/usr/bin/env python3
"""Profiles backends along a pour by Nsight Compute: states from the first frame to the last, every kernel's counters.

    profile_pour.py FOLDER --scene fixtures/scenes/pour-56k.json

Records the states once, runs `decant bench --profile` on each with each backend, and gathers all in FOLDER/profile.h5.
What is there is not run again, so the same command goes on after an interruption. Needs a GPU and ncu. Pictures:
plot_profile.py. Exit status: 0 all is there, 3 something is missing (--seconds ran out, or a run failed).
"""

import argparse
import json
import re
import subprocess
import time
from pathlib import Path

import numpy as np

from one_line import read_text, refuse, run_main
from study_runs import about, keep, last_line, plain, run, write_table

# The published study's ladder of hashes, then ours; lists rebuilt every substep, every ten, before a pair is missed.
BACKENDS = ["brute", "hash:wall_cells=off:sort=thrust:force_neighbors=recomputed",
            "hash:moving_walls=rebuilt:sort=thrust:force_neighbors=recomputed",
            "hash:sort=thrust:force_neighbors=recomputed", "hash:launch=stream", "list:rebuild=1:launch=stream",
            "list:rebuild=10:skin=0:launch=stream", "list:launch=stream"]
UNITS = {"time": "us", "shared_memory": "byte", "dram_bytes": "MB", "l2_bytes": "MB", "occupancy_theoretical": "%",
         "occupancy_achieved": "%", "issue_utilisation": "%", "excessive_share": "%", "l1_hit_rate": "%",
         "l2_hit_rate": "%"}


def schedule_of(scene):
    """End, s, and number of frames of a scene file, which may hold comments."""
    text = re.sub(r"^\s*//.*$|(?<=[,{\[\]}\d\"\s])//[^\"\n]*$", "", read_text(scene, "a scene"), flags=re.MULTILINE)
    try:
        times = json.loads(text)["time"]
        return float(times["end"]), int(times["frames"])
    except (ValueError, KeyError) as error:
        refuse(f"{scene}: no scene with time.end and time.frames: {error}")


def record_states(arguments, folder):
    """The states' frames and files; recorded where one is missing."""
    end, frames = schedule_of(arguments.scene)
    chosen = sorted({round(k * frames / (arguments.states - 1)) for k in range(arguments.states)})
    files = {frame: folder / f"frame-{frame:04}.h5" for frame in chosen}
    if not all(file.is_file() for file in files.values()):
        phases = [word for frame in chosen for word in ("--phase", f"frame-{frame:04}={end * frame / frames:.9g}")]
        run([arguments.decant, "record", arguments.scene, "--backend", "list", "--sample", "--quiet", *phases,
             "--ensemble-substeps", "1", "--ensemble-members", "2", "--out", folder / "{phase}.h5"])
    return files


def coarse_to_fine(items):
    """The first, the middle, the quarters, …, so that what there is after an interruption spans the whole."""
    width = max(1, (len(items) - 1).bit_length())
    return [items[k] for k in sorted(range(len(items)), key=lambda k: f"{k:0{width}b}"[::-1])]


def gather(folder, done, provenance):
    """One row per state, backend and kernel."""
    rows = [(frame, backend, kernel) for frame, backend, file in done
            for kernel in json.loads(file.read_text())[0]["kernels"]]
    names = sorted({key for _, _, kernel in rows for key in kernel} - {"kernel"})
    columns = {"frame": [frame for frame, *_ in rows], "backend": [backend for _, backend, _ in rows],
               "kernel": [kernel["kernel"] for *_, kernel in rows]}
    columns |= {name: [kernel.get(name, np.nan) for *_, kernel in rows] for name in names}
    write_table(folder / "profile.h5", "decant_profile", columns, UNITS, provenance)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--scene", type=Path, required=True)
    parser.add_argument("--states", type=int, default=25, help="evenly spaced over the frames; default: 25")
    parser.add_argument("--backend", action="append", help="may be repeated; default: the ladder of hash, and lists")
    parser.add_argument("--decant", default="build/release/bin/decant")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="start nothing after so long")
    arguments = parser.parse_args()
    if arguments.states < 2:
        refuse("--states: 2 at least")
    start = time.monotonic()
    (arguments.folder / "runs").mkdir(parents=True, exist_ok=True)
    build = about(arguments.decant, "cuda")  # kernels of a host have no counters
    files = record_states(arguments, arguments.folder)
    backends = arguments.backend or BACKENDS
    done, missing = [], 0
    # State by state, so that what is there after an interruption is of all backends.
    for frame, state in coarse_to_fine(list(files.items())):
        for backend in backends:
            file = arguments.folder / "runs" / f"{frame:04}-{plain(backend)}.json"
            if not file.is_file() and time.monotonic() - start < arguments.seconds:
                told = subprocess.run([arguments.decant, "bench", state, "--backend", backend, "--executor", "cuda",
                                       "--profile", "--json"], capture_output=True, text=True)
                if told.returncode == 0:
                    keep(file, told.stdout)
                else:
                    print(f"frame {frame}, {backend}: {last_line(told.stderr)}", flush=True)
            if file.is_file():
                done.append((frame, backend, file))
            else:
                missing += 1
    if done:
        gather(arguments.folder, sorted(done, key=lambda one: one[0]), {
            "scene": arguments.scene.name, "device": build["device"], "git_revision": build["git_revision"]})
    total = len(files) * len(backends)
    print(f"{len(done)} of {total} profiles in {arguments.folder / 'profile.h5'}, {time.monotonic() - start:.0f} s"
          + (f"; {missing} are missing, the same command goes on" if missing else ""))
    return 3 if missing else 0


if __name__ == "__main__":
    run_main(main)
