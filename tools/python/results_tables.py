#!/usr/bin/env python3
"""Fills the tables of measured results in Markdown documents from the files in fixtures/results.

A document marks each table: <!-- results: NAME --> … <!-- /results -->. What stands between is replaced, with
device and revision in the line below the table. --check changes nothing and exits with 1 where a document
differs from its data; --list names the tables."""

import argparse
import difflib
import json
import re
import sys
from pathlib import Path

import h5py
import numpy as np

from merge_fuzz import GROUPS
from one_line import read_text, refuse, run_main
from option_names import current
from study_runs import columns_of, provenance_of

ROOT = Path(__file__).resolve().parents[2]
RESULTS = ROOT / "fixtures" / "results"
PHASES = ("settled", "tilt-onset", "stream", "splash", "filling", "rest")


def text(value):
    return value.decode() if isinstance(value, bytes) else str(value)


def table(heading, rows):
    lines = ["| " + " | ".join(heading) + " |", "|" + "---|" * len(heading)]
    return "\n".join(lines + ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows])


def source(path, device, revision):
    return f"\n\n{device}, revision {revision} (`{path.relative_to(ROOT)}`)."


def device_of(said):
    return re.sub(r"^cuda: |, CUDA driver.*$", "", said)


def bench(name):
    path = RESULTS / "h200" / f"{name}.json"
    data = json.loads(path.read_text(encoding="utf-8"))
    device = device_of(data["rows"][0]["device"])
    return data["rows"], source(path, device, data["provenance"]["git_revision"])


def renamed(backend):
    name, _, options = backend.partition(":")
    return ":".join(filter(None, [name, current(options)]))


def significant(x, digits=3):
    """1234.5 -> 1,230"""
    rounded = float(f"{x:.{digits}g}")
    return f"{rounded:,.0f}" if rounded >= 10 ** (digits - 1) else f"{rounded:.{digits}g}"


def verdicts():
    """Largest score of some recordings by backend."""
    path = RESULTS / "h200" / "conformance.h5"
    with h5py.File(path) as file:
        rows = {
            name: file[f"summary/{name}"][:] for name in ("backend", "fixture", "score", "check", "field", "verdict")
        }
        provenance = {k: text(v) for k, v in file["provenance"].attrs.items()}
    backends = sorted({text(b) for b in rows["backend"]})
    fixtures = sorted({text(f) for f in rows["fixture"]})
    shown = []
    for fixture in ("hostile-crowd", "hostile-periodic", "motion-drum", "pour-4k-stream", "pour-56k-filling"):
        cells = []
        for backend in backends:
            of = (rows["fixture"] == fixture.encode()) & (rows["backend"] == backend.encode())
            passed = (rows["verdict"][of] == b"pass").all()
            cells.append(f"{'pass' if passed else 'FAIL'}, {rows['score'][of].max():.3f}")
        of = rows["fixture"] == fixture.encode()
        worst = rows["score"][of].argmax()
        shown.append([f"`{fixture}`", *cells, f"{text(rows['check'][of][worst])}, {text(rows['field'][of][worst])}"])
    passed = (rows["verdict"] == b"pass").all()
    last = (
        f"\n\nAll {len(fixtures)} recordings × {len(backends)} backends, {len(rows['score']):,} rows: "
        + ("pass" if passed else "FAIL")
        + f", largest score {rows['score'].max():.3f}. "
    )
    return (
        table(["recording", *(f"`{b}`" for b in backends), "largest in"], shown)
        + last
        + source(path, device_of(provenance["device.hash"]), provenance["git_revision"]).strip()
    )


LADDER = [
    ("brute", "all pairs"),
    ("hash:wall_cells=off:force_neighbors=recomputed:sort=thrust", "hash, every wall particle tested, Thrust sort"),
    (
        "hash:moving_walls=rebuilt:force_neighbors=recomputed:sort=thrust",
        "+ a grid for the fluid and one per container, the moving one rebuilt",
    ),
    ("hash:moving_walls=rebuilt:force_neighbors=recomputed", "+ counting sort, substeps captured as a CUDA graph"),
    ("hash:force_neighbors=recomputed", "+ moving walls looked up in their own frame"),
    ("hash", "+ pairs cached for the force pass (the default)"),
    ("list:build=all-pairs:rebuild=10", "list from all pairs, every 10 substeps"),
    ("list:rebuild=10", "list from cells, every 10 substeps (may miss pairs)"),
    ("list:criterion=relative", "list, rebuilt by relative displacement"),
    ("list", "list, rebuilt by displacement (the default)"),
    ("reference", "the sequential reference, one core"),
    ("reference:all-pairs", "the same by all pairs"),
]


def substep_times():
    rows, where = bench("bench")
    times = {(renamed(f"{r['backend']}:{r['options']}"), r["window"]): r["substep_us"] for r in rows}
    shown = [
        [f"`{name}`", what, *(significant(times[name, w]) if (name, w) in times else "" for w in ("stream", "filling"))]
        for name, what in LADDER
        if any((name, w) in times for w in ("stream", "filling"))
    ]
    particles = next(r["particles"] for r in rows)
    return (
        f"µs per substep, {particles:,} fluid and {rows[0]['wall_particles']:,} wall particles:\n\n"
        + table(["backend", "what", "stream", "filling"], shown)
        + where
    )


def scaling():
    columns, wheres = {}, []
    for name in ("bench", "large", "larger"):
        rows, where = bench(name)
        wheres.append(where.strip())
        for r in rows:
            if not r["options"] and r["backend"] in ("hash", "list") and r["window"] == "filling":
                columns.setdefault(r["particles"], {})[r["backend"]] = r
    shown = []
    for backend in ("hash", "list"):
        rates = [
            f"{r['particles'] / r['substep_us'] / 1e3:.2f}" for r in (columns[n][backend] for n in sorted(columns))
        ]
        sizes = [f"{columns[n][backend]['device_bytes_per_particle']:.0f}" for n in sorted(columns)]
        shown.append([f"`{backend}`", *rates, ", ".join(sizes)])
    return (
        table(["10⁹ particle-substeps per second", *(f"{n:,}" for n in sorted(columns)), "bytes per particle"], shown)
        + "\n\n"
        + "\n".join(wheres)
    )


def pours():
    shown, wheres = [], []
    for backend in ("brute", "hash", "list"):
        path = RESULTS / "h200" / f"pour-56k-{backend}.json"
        d = json.loads(path.read_text(encoding="utf-8"))
        regions = d["places"]
        shown.append(
            [
                f"`{backend}`",
                significant(d["substep_us"]),
                *(
                    f"{100 * regions[r]['fraction']:.3f} %"
                    for r in ("receiver", "source", "in_flight", "spilled", "lost")
                ),
                d["wall_crossings"],
            ]
        )
        wheres.append(source(path, device_of(d["device"]), d["provenance"]["git_revision"]).strip())
    return (
        table(
            ["backend", "µs per substep", "receiver", "source", "in flight", "spilled", "lost", "through a wall"], shown
        )
        + "\n\n"
        + "\n".join(wheres)
    )


def drift_rows():
    path = RESULTS / "h200" / "drift" / "drift-56k.h5"
    with h5py.File(path) as file:
        rows = {name: data[:] for name, data in file["rows"].items()}
        provenance = {k: text(v) for k, v in file["provenance"].attrs.items()}
    rows["phase"] = [text(f).partition("@")[2] for f in rows["fixture"]]
    device = device_of(provenance.get("device", provenance.get("device.list", "NVIDIA H200")))
    return rows, source(path, device, provenance["git_revision"])


def stale_lists():
    rows, where = drift_rows()
    index = {
        (p, int(i), round(float(s), 2)): k
        for k, (p, i, s) in enumerate(zip(rows["phase"], rows["interval"], rows["skin"]))
    }
    shown = []
    for phase in PHASES:
        k = index[phase, 10, 0.0]
        every = index[phase, 1, 0.0]
        auto = next(j for (p, i, _), j in index.items() if p == phase and i == 0)
        shown.append(
            [
                phase,
                f"{100 * rows['worst_missed_share'][k]:.2f} %",
                f"{100 * rows['acceleration_rms'][k]:.2g} %",
                *(f"{rows['substep_us'][j]:.0f}" for j in (k, auto, every)),
            ]
        )
    return (
        table(
            [
                "phase",
                "pairs missed, at most",
                "acceleration, RMS error",
                "µs per substep",
                "adaptive",
                "every substep",
            ],
            shown,
        )
        + where
    )


def campaigns():
    shown = []
    for folder in ("h200", "host"):
        path = RESULTS / folder / "fuzz.h5"
        with h5py.File(path) as file:
            a = file.attrs
            _, statistics, counterexamples = GROUPS[int(a["decant_fuzz"])]
            t = file[statistics]
            backends = sorted({renamed(text(b)) for b in t["backend"][:]} - {"scene"})
            shown.append(
                [
                    device_of(text(a["device"])),
                    ", ".join(backends),
                    f"{int(a['cases']):,}",
                    len(file[f"{counterexamples}/seed"]),
                    f"{a['cases'] / a['seconds']:.0f}",
                    text(file["provenance"].attrs["git_revision"]),
                ]
            )
    return table(["device", "backends", "cases", "counterexamples", "cases per second", "revision"], shown)


def faults():
    """What the last lines of the tables say."""
    shown = []
    for what, path in (
        ("planted, host", "host/faults.txt"),
        ("planted, H200", "h200/faults.txt"),
        ("held out, host", "host/heldout.txt"),
        ("mutations, host", "host/mutants.txt"),
    ):
        lines = (RESULTS / path).read_text(encoding="utf-8").strip().split("\n")
        revision = next((m[1] for line in lines[:3] if (m := re.search(r"revision ([0-9a-f]{7})", line))), "")
        shown.append([what, lines[-1], revision, f"`fixtures/results/{path}`"])
    return table(["faults", "outcome", "revision", "file"], shown)


def gates():
    path = RESULTS / "h200" / "validation" / "validation.h5"
    with h5py.File(path) as file:
        q, runs = file["quantities"], file["runs"]
        case = [text(runs["case"][k]) for k in q["run"][:]]
        verdict = [text(v) for v in q["verdict"][:]]
        revision, device = text(file["provenance"].attrs["git_revision"]), device_of(text(runs["device"][0]))
    shown = []
    for name in dict.fromkeys(case):
        of = [v for c, v in zip(case, verdict) if c == name]
        shown.append([f"`{name}`", of.count("pass"), of.count("fail"), of.count("reported")])
    shown.append(["all", verdict.count("pass"), verdict.count("fail"), verdict.count("reported")])
    return table(["case", "gates met", "missed", "reported without a gate"], shown) + source(path, device, revision)


def study():
    from plot_profile import Profile, table as beside_published  # here: it draws, too

    file = RESULTS / "h200" / "study" / "profile.h5"
    profile = Profile(file)
    where = f"Frame {profile.common_frame()} of {profile.about['scene']} where no other is named."
    return f"{beside_published(profile)}\n\n{where}" + source(file, device_of(profile.about["device"]),
                                                              profile.about["git_revision"])


def study_columns(name):
    """Columns of a table of the study, and its line of source; the device is that of its provenance."""
    path = RESULTS / "h200" / "study" / f"{name}.h5"
    with h5py.File(path) as file:
        columns, about = columns_of(file), provenance_of(file)
    return columns, about, source(path, device_of(about["device"]), about["git_revision"])


def study_size():
    c, _, where = study_columns("size")
    shown = []
    for n in sorted(set(c["particles"].tolist())):
        row = [f"{n:,.0f}"]
        for backend in ("brute", "hash", "list"):
            (k,) = np.flatnonzero((c["particles"] == n) & (c["backend"] == backend)).tolist() or (None,)
            if k is None or c["outcome"][k] != "timed":
                row.append("")
                continue
            row.append(f"{1e3 * c['substep_us'][k] / n:.3g} ns, {c['device_bytes_per_particle'][k]:.0f} B")
        shown.append(row)
    return table(["particles", "`brute`", "`hash`", "`list`"], shown) + where


def study_error():
    c, about, where = study_columns("error")
    order = np.argsort(np.where(np.isnan(c["substep_us"]), np.inf, c["substep_us"]), kind="stable")
    shown = []
    for k in order:
        missed = c["drift_worst_missed_share"][k]
        shown.append([f"`{c['option_set'][k]}`",
                      "breaks down" if np.isnan(c["substep_us"][k]) else f"{c['substep_us'][k]:.3g} µs",
                      f"{c['score'][k]:.3g}", "" if np.isnan(missed) else f"{100 * missed:.2g} %", c["verdict"][k]])
    what = f"{about['recording']}, {int(about['particles']):,} particles."
    return table(["options", "substep", "score", "pairs missed at worst", "verdict"], shown) + f"\n\n{what}" + where


def live():
    path = RESULTS / "h200" / "live.json"
    told = json.loads(path.read_text(encoding="utf-8"))
    shown = [[f"{row['particles']:,}", f"`{row['backend']}`", f"{row['pictures_per_second']:.1f}",
              f"{row['substeps_per_second']:,.0f}", f"{row['slower_percent']:.0f} %",
              f"{row['picture_bytes'] / 1e6:.1f} MB", f"{row['more_memory_MB']:.0f} MB"] for row in told["rows"]]
    heads = ["particles", "backend", "pictures/s", "substeps/s unwatched", "slower watched", "a picture", "memory"]
    return table(heads, shown) + source(path, device_of(told["rows"][0]["device"]), told["provenance"]["git_revision"])


def tiles():
    rows, where = bench("tiles")
    times = {(r["options"], r["window"]): r for r in rows}
    shown = []
    for phase in sorted({r["window"] for r in rows}, key=PHASES.index):
        without, with_tiles = times["tiles=off", phase], times["", phase]
        shown.append(
            [
                phase,
                *(significant(r["substep_us"]) for r in (without, with_tiles)),
                f"{with_tiles['substep_us'] / without['substep_us']:.2f}",
                *(f"{r['substeps_per_rebuild']:.1f}" for r in (without, with_tiles)),
            ]
        )
    return (
        f"µs per substep of `list`, {rows[0]['particles']:,} fluid and {rows[0]['wall_particles']:,} wall "
        + "particles:\n\n"
        + table(["pour", "without tiles", "in tiles", "ratio", "substeps per rebuild, without", "in tiles"], shown)
        + where
    )


def beside():
    """Two revisions in turn: of each the faster of its rounds."""
    path = RESULTS / "h200" / "beside-bfd0938.txt"
    lines = path.read_text(encoding="utf-8").split("\n\n", 1)[1].strip().split("\n")[1:]
    times = {}
    for revision, backend, _, particles, window, took in (line.split()[:6] for line in lines):
        of = times.setdefault((window, int(particles), backend), {})
        of[revision] = min(of.get(revision, float("inf")), float(took))
    before, after = next(iter(times.values()))
    shown = [
        [window, f"{particles:,}", f"`{backend}`", *(significant(of[r]) for r in (before, after)),
         f"{of[after] / of[before]:.2f}"]
        for (window, particles, backend), of in times.items()
    ]  # fmt: skip
    return table(["state", "particles", "backend", f"{before}, µs", f"{after}, µs", "ratio"], shown) + (
        f"\n\nNVIDIA H200 (`{path.relative_to(ROOT)}`)."
    )


def ranks():
    shown, where = [], ""
    for name in ("ranks-3M", "ranks-16M"):
        path = RESULTS / "h200-x2" / f"{name}.json"
        told = json.loads(path.read_text(encoding="utf-8"))
        rows = {(row["backend"], row["options"]): row for row in told["rows"]}
        for backend in ("hash", "list"):
            one, two = rows[backend, ""], rows[backend, "ranks=2"]
            speedup = one["substep_us"] / two["substep_us"]
            memory = two["device_bytes_per_particle"] / one["device_bytes_per_particle"]
            shown.append([f"{one['particles']:,}", f"`{backend}`", significant(one["substep_us"], 4),
                          significant(two["substep_us"], 4), f"{speedup:.2f}", f"{100 * speedup / 2:.0f} %",
                          f"{memory:.2f}"])
        where += source(path, "2 × " + device_of(one["device"]), told["provenance"]["git_revision"])
    heads = ["particles", "backend", "one GPU, µs per substep", "two", "speedup", "efficiency",
             "memory per particle, ratio"]
    return table(heads, shown) + where


TABLES = {
    "ranks": ranks,
    "beside": beside,
    "tiles": tiles,
    "live": live,
    "study-size": study_size,
    "study-error": study_error,
    "study": study,
    "verdicts": verdicts,
    "substep-times": substep_times,
    "scaling": scaling,
    "pours": pours,
    "stale-lists": stale_lists,
    "campaigns": campaigns,
    "faults": faults,
    "gates": gates,
}
BLOCK = re.compile(r"(<!-- results: ([a-z-]+) -->\n).*?(<!-- /results -->)", re.DOTALL)


def filled(document, path):
    def block(match):
        if match[2] not in TABLES:
            sys.exit(f"{path}: results: {match[2]}: one of {', '.join(TABLES)}")
        return f"{match[1]}\n{TABLES[match[2]]()}\n\n{match[3]}"

    return BLOCK.sub(block, document)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("document", nargs="*", type=Path, help="default: every Markdown file with a marked table")
    parser.add_argument("--check", action="store_true", help="change nothing; exit with 1 where text and data differ")
    parser.add_argument("--list", action="store_true", help="names of the tables")
    arguments = parser.parse_args()
    if arguments.list:
        print("\n".join(TABLES))
        return 0
    documents = arguments.document or [
        p
        for folder in ("*.md", "*/*.md", "fixtures/results/*.md", "fixtures/results/*/study/*.md")
        for p in sorted(ROOT.glob(folder))
    ]
    differ = 0
    for path in documents:
        before = read_text(path, "a Markdown document")
        if arguments.document and not BLOCK.search(before):
            refuse(f"{path}: no table is marked in it")
        after = filled(before, path)
        if before == after:
            continue
        differ += 1
        if arguments.check:
            sys.stdout.writelines(
                difflib.unified_diff(before.splitlines(True), after.splitlines(True), str(path), "its data")
            )
        else:
            path.write_text(after, encoding="utf-8")
            print(f"{path}: filled in")
    return 1 if arguments.check and differ else 0


if __name__ == "__main__":
    run_main(main)
