#!/usr/bin/env python3
"""Draws what `decant drift --report` measured: error against rebuild interval with what theory expects,
cost against error with the list recommended, and missed pairs over the pour (or the windows)."""

import argparse

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from one_line import open_hdf5, run_main  # noqa: E402

COLORS = ["#4c78a8", "#e45756", "#54a24b", "#b279a2", "#f58518", "#72b7b2", "#9d755d"]
NONE_SEEN = 1e-8  # where a list that misses nothing is drawn


def columns(group):
    return {k: np.array([v.decode() for v in d[:]]) if d.dtype.kind == "S" else d[:]
            for k, d in group.items()}


def draw_errors(axes, rows, fixtures, skins):
    for fixture, color in zip(fixtures, COLORS * 9):
        for skin, style in zip(skins, ["-", "--"]):
            this = (rows["fixture"] == fixture) & (rows["skin"] == skin) & (rows["interval"] > 1)
            interval, error = rows["interval"][this], rows["acceleration_rms"][this]
            axes.plot(interval[error > 0], error[error > 0], style, color=color, marker=".", lw=1.2)
            expected = rows["expected_acceleration_rms"][this]
            axes.plot(interval[expected > 0], expected[expected > 0], ":", color=color, lw=0.9)
    axes.set(xscale="log", yscale="log", xlabel="substeps between rebuilds",
             ylabel="acceleration, RMS error / RMS field")
    ticks = sorted(set(rows["interval"][rows["interval"] > 1]))
    axes.set_xticks(ticks, [str(t) for t in ticks])
    axes.minorticks_off()
    named = ", ".join(f"skin {s:g} H ({n})" for s, n in zip(skins, ["—", "- -"]))
    axes.set_title(f"{named}; theory (···)", fontsize=9)


def lists_over_windows(rows, windows):
    """(interval, skin, mean µs, largest error) of every list that all windows measured."""
    lists = []
    for interval, skin in sorted({(i, s) for i, s in zip(rows["interval"], rows["skin"]) if i > 0}):
        this = (rows["interval"] == interval) & (rows["skin"] == skin)
        if this.sum() == windows and not np.isnan(rows["substep_us"][this]).any():
            lists.append((interval, skin, rows["substep_us"][this].mean(),
                          rows["acceleration_rms"][this].max()))
    return lists


def draw_front(axes, rows, windows, tolerance):
    lists = lists_over_windows(rows, windows)
    for interval, skin, cost, error in lists:
        shade = plt.cm.viridis(min(skin / 0.25, 1.0))
        axes.plot(cost, max(error, NONE_SEEN), "o", color=shade, ms=5)
        axes.annotate(f"{interval}", (cost, max(error, NONE_SEEN)), fontsize=6,
                      xytext=(3, 2), textcoords="offset points")
    front, least = [], np.inf
    for item in sorted(lists, key=lambda item: item[2]):
        if item[3] < least:
            least = item[3]
            front.append((item[2], max(item[3], NONE_SEEN)))
    if front:
        axes.plot(*zip(*front), color="#999", lw=0.8, zorder=0, drawstyle="steps-post")
    adaptive = rows["substep_us"][rows["interval"] == 0]
    best = [(cost, error) for _, _, cost, error in lists if error <= 0.5 * tolerance]
    if len(adaptive) and not np.isnan(adaptive).any():
        axes.plot(adaptive.mean(), NONE_SEEN, "*", color="#e45756", ms=12)
        best.append((adaptive.mean(), NONE_SEEN))
    if best:
        cost, error = min(best)
        axes.plot(cost, max(error, NONE_SEEN), "o", ms=14, mfc="none", mec="#e45756")
    axes.axhline(tolerance, color="#e45756", lw=0.8, ls=":")
    axes.set(yscale="log", xlabel="µs a substep, rebuilds included",
             ylabel="acceleration error, worst window")
    axes.set_title("interval written beside; dark: no skin, light: 0.2 H;\n★ adaptive, "
                   f"○ recommended for {tolerance:g}; 1e-8: nothing missed", fontsize=8)


def draw_missed(axes, file, rows, fixtures):
    pour = columns(file["pour"])
    if len(pour["time"]):
        this = (pour["interval"] == 10) & (pour["skin"] == 0)
        for kind, color in (("fluid", COLORS[0]), ("wall", COLORS[1])):
            share = pour[f"{kind}_missed"][this] / np.maximum(pour[f"{kind}_within"][this], 1)
            axes.plot(pour["time"][this], 100 * share, color=color, label=f"{kind} pairs", lw=1.2)
        axes.set_xlabel("t, s")
        axes.set_title("the published setting, every 10 without skin,\njust before each rebuild",
                       fontsize=9)
    else:
        samples = columns(file["samples"])
        longest = samples["interval"].max()
        for fixture, color in zip(fixtures, COLORS * 9):
            this = ((samples["fixture"] == fixture) & (samples["skin"] == 0)
                    & (samples["interval"] == longest))
            share = samples["fluid_missed"][this] / np.maximum(samples["fluid_within"][this], 1)
            axes.plot(samples["age"][this], 100 * share, color=color, lw=1.2)
        axes.set_xlabel("substeps since the rebuild, without skin")
    axes.set_ylabel("missed, % of pairs")
    if len(pour["time"]):
        axes.legend(fontsize=8, frameon=False)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("report", help="HDF5 of decant drift")
    parser.add_argument("--out", required=True, help="PNG")
    parser.add_argument("--tolerance", type=float, default=1e-3, help="for the list recommended")
    arguments = parser.parse_args()
    with open_hdf5(arguments.report, ["decant_drift"], "a report of decant drift") as file:
        rows = columns(file["rows"])
        fixtures = list(dict.fromkeys(rows["fixture"]))
        skins = sorted({s for s in rows["skin"][rows["derived"] == 0] if not np.isnan(s)})
        shown = [s for s in (0.0, 0.1) if s in skins] or skins[:2]
        figure, axes = plt.subplots(1, 3, figsize=(15, 4.6), constrained_layout=True)
        draw_errors(axes[0], rows, fixtures, shown)
        draw_front(axes[1], rows, len(fixtures), arguments.tolerance)
        draw_missed(axes[2], file, rows, fixtures)
        for fixture, color in zip(fixtures, COLORS * 9):
            axes[0].plot([], [], color=color, label=fixture)
        axes[0].legend(fontsize=7, frameon=False)
        device = file.attrs["device"].decode()
    figure.suptitle(device, fontsize=9)
    for axis in axes:
        axis.spines[["top", "right"]].set_visible(False)
    figure.savefig(arguments.out, dpi=75)


if __name__ == "__main__":
    run_main(main)
