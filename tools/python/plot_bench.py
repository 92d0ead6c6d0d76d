#!/usr/bin/env python3
"""Draws what `decant bench --report FILE.json` measured: stages of a substep by backend, and how much faster than
the published study each step of the way is (its figures are of an RTX 2080, 56,000 particles)."""

import argparse

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from option_names import current
from one_line import read_json, run_main

STAGES = ["build", "density", "force", "integrate"]
COLORS = ["#4c78a8", "#f58518", "#54a24b", "#b279a2"]
LABELS = {"force": "force (lists: and integration)"}
PUBLISHED = {  # us a substep
    "brute": 176060.0,
    "list": 11340.0,
    "hash": 9540.0,
}


def label(row):
    options = current(row["options"])
    return row["backend"] + (": " + options.replace(":", ", ") if options else "")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("bench", help="JSON of decant bench")
    parser.add_argument("--window", default="filling")
    parser.add_argument("--out", required=True, help="PNG")
    arguments = parser.parse_args()
    found = read_json(arguments.bench, "rows", list, "JSON of decant bench")
    rows = [r for r in found["rows"] if r["window"] == arguments.window]
    if not rows:
        parser.error(f"{arguments.bench}: no rows of window {arguments.window}")

    figure, (left, right) = plt.subplots(1, 2, figsize=(13, 5.4), constrained_layout=True)
    places = range(len(rows))
    for place, row in zip(places, rows):
        bottom = 0.0
        total = sum((row["stages_us"] or {}).get(s, 0) for s in STAGES) or 1
        for stage, color in zip(STAGES, COLORS):
            # Stages are launched apart; their shares are drawn, of the substep as it runs.
            share = (row["stages_us"] or {}).get(stage, 0) / total * 100
            left.bar(place, share, bottom=bottom, color=color, label=LABELS.get(stage, stage) if place == 0 else None)
            bottom += share
        left.text(place, 101, f"{row['substep_us']:.0f}", ha="center", va="bottom", fontsize=7)
    left.set_ylim(0, 120)
    left.set_ylabel("share of a substep, % (µs above)")
    left.legend(fontsize=8, loc="upper center", ncol=len(STAGES), frameon=False)
    gains = [PUBLISHED[r["backend"]] / r["substep_us"] for r in rows]
    right.bar(places, gains, color="#4c78a8")
    for place, gain in zip(places, gains):
        right.text(place, gain, f"{gain:.0f}×" if gain >= 1 else f"{gain:.2f}×", ha="center",
                   va="bottom", fontsize=7)
    right.set_yscale("log")
    right.set_ylabel("times faster than the published backend of that kind")
    for axes in (left, right):
        axes.set_xticks(places)
        axes.set_xticklabels([label(r) for r in rows], fontsize=7, rotation=35, ha="right")
        axes.spines[["top", "right"]].set_visible(False)
    figure.suptitle(f"{rows[0]['particles']} particles, {arguments.window}, {rows[0]['device']}",
                    fontsize=10)
    figure.savefig(arguments.out, dpi=80)


if __name__ == "__main__":
    run_main(main)
