#!/usr/bin/env python3
"""Measures what every set of options of the backends costs, and how far it is from the oracle, on one recording.

    cost_by_error.py FOLDER

Cost is the time per substep by `decant bench`. Error is the largest score, |error| / tolerance, over values: in the
checks of `decant conform`, which judges what the backend itself computes, and, of lists rebuilt at a fixed interval,
in `decant drift`, which sees them at every age: `conform` looks at this recording's run after few substeps only. Up to
1 conforms. Values without a tolerance, as neighbor counts, have a verdict and no score.
No option trades precision for time. What rounding would do is in FOLDER/error.h5, too, where decant_faults lies beside
the command: backends with values rounded on purpose, whose score is measured and whose time says nothing.
Reports are kept in FOLDER/runs, and what they hold is not run again. Pictures: plot_study.py. Exit status: 0 all is
there, 3 something is missing (--seconds ran out, or a run failed).
"""

import argparse
import json
import re
import time
from pathlib import Path

import h5py
import numpy as np

from one_line import refuse, run_main
from study_runs import (ROOT, about, columns_of, keep, last_line, name_of, plain, provenance_of, recording, run_for,
                        write_table)

INTERVALS, SKINS = (1, 2, 5, 10, 20, 50, 100), (0, 0.1, 0.2)
OPTIONS = {
    "brute": [""],
    "hash": ["", "wall_cells=off", "moving_walls=rebuilt", "sort=thrust", "force_neighbors=recomputed",
             *(f"threads_per_particle={n}" for n in (1, 2, 4, 8)), "launch=stream"],
    "list": ["", *(f"skin={s}" for s in (0.05, 0.1, 0.2, 0.3, 0.4)), "criterion=relative", "build=all-pairs",
             *(f"threads_per_particle={n}" for n in (1, 2, 4, 8)), "launch=graph", "launch=stream"],
}
CHECKS = ("fields", "substep", "advanced", "trajectory")
FIELDS = ("boundary_volume", "density", "pressure", "equation_of_state", "acceleration", "evaluation")
BATCH = 12  # sets judged in one call: what a kill loses at most
# Planted faults that compute or store with fewer bits (tests/faults/catalogue.py).
ROUNDED = ("half-velocity", "half-pressure", "rounded-density", "cancelling-distance", "fast-root", "fast-reciprocal")
UNITS = {"substep_us": "us", "fastest_us": "us", "slowest_us": "us", "device_bytes_per_particle": "byte"}
TIMED = ("substep_us", "fastest_us", "slowest_us", "substeps_per_rebuild", "device_bytes_per_particle")
DRIFTED = ("density_score", "acceleration_score", "density_rms", "acceleration_rms", "missed_share",
           "worst_missed_share", "own_missed_share", "deviation_over_ensemble")


def fixed_list(interval, skin):
    return f"list:rebuild={interval}:skin={skin:g}"


def option_sets(arguments):
    chosen = arguments.option_set or [name + (options and f":{options}") for name, all_of in OPTIONS.items()
                                      for options in all_of]
    return list(dict.fromkeys([*chosen, *(fixed_list(i, s) for s in arguments.skins for i in arguments.intervals)]))


def is_plugin(name):
    return name.startswith(("plugin:", "python:"))


class Reports:
    """Reports of one verb on one recording, numbered; each holds some of the option sets. A plug-in goes by a name of
    its own in a report, and has one for itself."""

    def __init__(self, verb, ending, arguments):
        self.folder, self.ending = arguments.folder / "runs", ending
        self.stem = f"{verb}-{arguments.executor}-{arguments.recording.stem}"

    def files(self):
        return sorted(self.folder.glob(f"{self.stem}-[0-9]*{self.ending}"))

    def next(self, sets=()):
        alone = f"-of-{plain(sets[0])}" if sets and is_plugin(sets[0]) else ""
        return self.folder / f"{self.stem}-{len(self.files()) + 1:03}{alone}{self.ending}"

    def name(self, path, backend, options):
        """The option set as files tell it apart."""
        return path.stem.partition("-of-")[2] or plain(name_of({"backend": backend, "options": options}))


def calls_for(sets, most):
    """So many sets to a call, and each plug-in apart."""
    ours = [name for name in sets if not is_plugin(name)]
    return [ours[k:k + most] for k in range(0, len(ours), most)] + [[name] for name in sets if is_plugin(name)]


def judged(reports):
    """Rows of `conform` by option set; not of a set that was interrupted."""
    found = {}
    for path in reports.files():
        with h5py.File(path) as file:
            rows = columns_of(file["summary"])
            revision = provenance_of(file)["git_revision"]
        names = np.array([reports.name(path, b, o) for b, o in zip(rows["backend"], rows["options"])])
        for name in dict.fromkeys(names.tolist()):
            if "interrupted" not in rows["reason"][names == name]:
                asked = (names == name) & (rows["verdict"] != "not_run")  # not what a plug-in does not offer
                found[name] = ({key: values[asked] for key, values in rows.items()}, revision)
    return found


def timed(reports):
    """Rows of `bench` by option set, with the revision."""
    found = {}
    for path in reports.files():
        told = json.loads(path.read_text(encoding="utf-8"))
        found |= {reports.name(path, row["backend"], row["options"]): (row, told["provenance"]["git_revision"])
                  for row in told["rows"]}
    return found


def drifted(reports):
    """Rows of `drift` by option set."""
    found = {}
    for path in reports.files():
        with h5py.File(path) as file:
            rows = columns_of(file["rows"])
        for k in np.flatnonzero(rows["interval"] > 0):
            found[plain(fixed_list(rows["interval"][k], rows["skin"][k]))] = {name: rows[name][k] for name in DRIFTED}
    return found


def judge(sets, reports, arguments, left):
    known = judged(reports)
    for some in calls_for([name for name in sets if plain(name) not in known], BATCH):
        if left() > 0:
            call(["conform", arguments.recording, "--backend", ",".join(some), "--check", ",".join(CHECKS), "--quiet",
                  "--report", reports.next(some)], arguments, left)


def refused(judgement):
    """Whether `bench` does not time it."""
    rows, _ = judgement
    return bool(((rows["verdict"] != "pass") & ~np.isin(rows["check"], ("advanced", "trajectory"))).any())


def measure_times(sets, reports, arguments, left):
    """In one call, so that all are timed alike."""
    known = timed(reports)
    for some in calls_for([name for name in sets if plain(name) not in known], max(len(sets), 1)):
        if left() > 0:
            told = call(["bench", arguments.recording, "--backend", ",".join(some), "--windows", str(arguments.windows),
                         "--json", "--report", reports.next(some)], arguments, left)
            for name, why in re.findall(r"^(\S+) +breaks down, is not timed: (.*)$", told, flags=re.MULTILINE):
                keep(broken(name, arguments), why)


def broken(name, arguments):
    """Where it is kept why a set has no time."""
    return arguments.folder / "runs" / f"breaks-{arguments.executor}-{arguments.recording.stem}-{plain(name)}.txt"


def measure_drift(reports, arguments, left):
    known = drifted(reports)
    intervals = [i for i in arguments.intervals if any(plain(fixed_list(i, s)) not in known for s in arguments.skins)]
    if intervals and arguments.skins and left() > 0:
        call(["drift", arguments.recording, "--intervals", ",".join(map(str, intervals)), "--skins",
              ",".join(f"{s:g}" for s in arguments.skins), "--window", str(arguments.window), "--quiet", "--report",
              reports.next()], arguments, left)


def call(command, arguments, left):
    done = run_for([arguments.decant, *command, "--executor", arguments.executor], left())
    if done.returncode == 2:
        refuse(f"{command[0]}: {last_line(done.stderr)}")
    if done.returncode not in (0, 1):
        print(f"{command[0]}: exit status {done.returncode}: {last_line(done.stderr)}", flush=True)
    return done.stderr


def judge_rounded(file, arguments, left):
    """Scores of backends that round on purpose, as decant_faults tells them: check and score by name."""
    program = Path(arguments.decant).with_name("decant_faults")
    faults = program.with_name("faults.json")
    if not file.is_file() and program.is_file() and faults.is_file() and left() > 0:
        aside = file.with_suffix(".part")
        run_for([program, faults, "--executor", arguments.executor, "--fixtures", ROOT / "fixtures", "--only", *ROUNDED,
                 "--out", aside], left())
        if aside.is_file():
            aside.replace(file)
    told = file.read_text(encoding="utf-8") if file.is_file() else ""
    lines = re.findall(r"^(\S+) +(\S+) +(\S+) +(no bound|\S+)  ([^;\n]*)", told, flags=re.MULTILINE)
    rows = [(name, backend, check, float("inf") if factor == "no bound" else float(factor), what)
            for name, backend, check, factor, what in lines
            if name in ROUNDED and re.fullmatch(r"no bound|[-+.e\d]+", factor)]
    return dict(zip(("name", "backend", "check", "score", "what"), map(list, zip(*rows))))


def largest(rows, checks):
    """Over the values that have a tolerance; infinite where one is no number."""
    scores = rows["score"][np.isin(rows["check"], checks) & (rows["tolerance"] != 0)]
    return float(np.where(np.isnan(scores), np.inf, scores).max()) if scores.size else float("nan")


def summed_up(rows, drift):
    """Scores and verdict of one option set."""
    scores = {f"score_{check}": largest(rows, FIELDS if check == "fields" else (check,)) for check in CHECKS}
    stale = [drift["density_score"], drift["acceleration_score"]] if drift else []
    passes = (rows["verdict"] == "pass").all()
    misses = bool(drift) and drift["worst_missed_share"] > 0
    return {**scores, "score_drift": max(stale, default=float("nan")),
            "score": max([scores["score_fields"], scores["score_advanced"], scores["score_substep"], *stale]),
            "fp32_reference_score": float(np.nanmax(rows["fp32_reference_score"])),
            "verdict": "fails" if not passes else "misses pairs, unseen by conform" if misses else "conforms"}


def gather(sets, judgements, times, drifts, rounded, arguments, provenance):
    """One row per option set that has all it needs; how many those are."""
    swept = {fixed_list(i, s) for s in arguments.skins for i in arguments.intervals}
    there = [name for name in sets if plain(name) in judgements and (plain(name) in drifts or name not in swept)
             and (plain(name) in times or refused(judgements[plain(name)]) or broken(name, arguments).is_file())]
    if not there:
        return 0
    rows = [(*judgements[plain(name)], *times.get(plain(name), ({}, "")), drifts.get(plain(name), {}))
            for name in there]
    sums = [summed_up(judged_rows, drift) for judged_rows, _, _, _, drift in rows]
    columns = {"option_set": there} | {key: [one[key] for one in sums] for key in sums[0]}
    columns |= {key: [float(row.get(key, np.nan)) for _, _, row, _, _ in rows] for key in TIMED}
    columns |= {f"drift_{key}": [float(drift.get(key, np.nan)) for *_, drift in rows] for key in DRIFTED}
    columns |= {"revision_conform": [revision for _, revision, *_ in rows],
                "revision_bench": [revision for _, _, _, revision, _ in rows]}
    with h5py.File(arguments.recording) as file:
        particles = len(file["state/position"])
    more = {"recording": arguments.recording.stem, "particles": str(particles),
            "drift_window": f"{arguments.window} substeps"}
    write_table(arguments.folder / "error.h5", "decant_cost_by_error", columns, UNITS, provenance | more,
                {"rounded": rounded} if rounded else None)
    return len(there)


def numbers(kind):
    return lambda said: [kind(one) for one in said.split(",") if one]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--recording", default="pour-56k-stream", help="file or name; default: pour-56k-stream")
    parser.add_argument("--option-set", action="append", help="as --backend of decant takes it, plug-ins too; may be "
                        "repeated; default: every option of brute, hash and list")
    parser.add_argument("--intervals", type=numbers(int), default=INTERVALS, help="of lists rebuilt every N substeps; "
                        f"default: {','.join(map(str, INTERVALS))}")
    parser.add_argument("--skins", type=numbers(float), default=SKINS, help="of these lists, shares of H; default: "
                        f"{','.join(map(str, SKINS))}")
    parser.add_argument("--window", type=int, help="substeps of drift; default: the longest interval")
    parser.add_argument("--executor", choices=("cuda", "host"), default="cuda")
    parser.add_argument("--windows", type=int, default=3, help="of bench: the median of so many; default: 3")
    parser.add_argument("--decant", default="build/release/bin/decant")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="end what runs after so long")
    arguments = parser.parse_args()
    start = time.monotonic()
    left = lambda: arguments.seconds - (time.monotonic() - start)
    (arguments.folder / "runs").mkdir(parents=True, exist_ok=True)
    arguments.recording = recording(arguments.recording)
    arguments.window = arguments.window or max([*arguments.intervals, 2])
    provenance = about(arguments.decant, arguments.executor)
    sets = option_sets(arguments)
    benches, conforms = Reports("bench", ".json", arguments), Reports("conform", ".h5", arguments)
    drifts = Reports(f"drift-{arguments.window}", ".h5", arguments)
    judge(sets, conforms, arguments, left)
    judgements = judged(conforms)
    unfit = [name for name in sets if broken(name, arguments).is_file()
             or plain(name) in judgements and refused(judgements[plain(name)])]
    measure_times([name for name in sets if name not in unfit], benches, arguments, left)
    measure_drift(drifts, arguments, left)
    rounded = judge_rounded(arguments.folder / "runs" / f"rounded-{arguments.executor}.txt", arguments, left)
    there = gather(sets, judgements, timed(benches), drifted(drifts), rounded, arguments, provenance)
    print(f"{there} of {len(sets)} option sets in {arguments.folder / 'error.h5'}, {time.monotonic() - start:.0f} s"
          + ("" if there == len(sets) else "; the same command goes on"))
    return 0 if there == len(sets) else 3


if __name__ == "__main__":
    run_main(main)
