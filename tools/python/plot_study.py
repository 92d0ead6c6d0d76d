#!/usr/bin/env python3
"""Draws what cost_by_size.py and cost_by_error.py gathered.

    plot_study.py FOLDER --out PICTURES

by-size.png: time and device memory per particle against the number of particles, by backend, with a band of ±10 %
about the median of 1 to 50 million particles. by-error.png: for every set of options its score against its time per
substep; below it all sets by name, on the same axis of time. Draws what there is of size.h5 and error.h5.
"""

import argparse
import re
import textwrap
from pathlib import Path

import numpy as np
from matplotlib.ticker import NullLocator

from figures import plt, save
from one_line import open_hdf5, refuse, run_main
from study_runs import columns_of, provenance_of

COLORS = {"brute": "#e45756", "hash": "#4c78a8", "list": "#54a24b"}
OTHER = "#79706e"
FIXED = {0.0: "#f58518", 0.1: "#b279a2", 0.2: "#9d755d"}  # lists with a fixed interval, by skin
LARGE = (1e6, 5e7)
BAND = 0.1
MOST = 1e7  # a score is drawn no higher


def plain_ticks(axis, most=15):
    """1, 2, 5, 10, … instead of powers, or more where those are too few; at most so many."""
    low, high = axis.get_view_interval()
    for steps in ((1, 2, 5), (1, 1.5, 2, 3, 4, 5, 6, 8)):
        ticks = [step * 10.0**k for k in range(-12, 13) for step in steps if low <= step * 10.0**k <= high]
        if len(ticks) > 2:
            break
    ticks = ticks[::-(-len(ticks) // most)]
    axis.set_ticks(ticks, [f"{tick:g}" for tick in ticks])
    axis.set_minor_locator(NullLocator())


def draw_by_size(axes, c, column):
    for backend in dict.fromkeys(c["backend"].tolist()):
        color = COLORS.get(backend, OTHER)
        of = (c["backend"] == backend) & np.isfinite(c[column])
        n, values = c["particles"][of], c[column][of]
        large = values[(n >= LARGE[0]) & (n <= LARGE[1])]
        label = backend
        if large.size:
            middle = np.median(large)
            low, high = 100 * (large.min() / middle - 1), 100 * (large.max() / middle - 1)
            label += f": {middle:.3g}, {low:+.0f} to {high:+.0f} %"
            axes.fill_between(LARGE, (1 - BAND) * middle, (1 + BAND) * middle, color=color, alpha=0.2, lw=0)
        axes.plot(n, values, "o-", ms=4, lw=1.2, color=color, label=label)
        for size in c["particles"][(c["backend"] == backend) & (c["outcome"] == "does not fit")]:
            axes.plot(size, values[-1] if values.size else 1, "x", ms=9, color=color)
    axes.set(xscale="log", yscale="log", xlabel="fluid particles")


def by_size(file, folder):
    c, about = columns_of(file), provenance_of(file)
    figure, (left, right) = plt.subplots(1, 2, figsize=(12, 5), constrained_layout=True)
    draw_by_size(left, c, "time_per_particle")
    draw_by_size(right, c, "device_bytes_per_particle")
    left.set_ylabel("ns per particle and substep")
    right.set_ylabel("bytes of device memory per fluid particle")
    for axes in (left, right):
        plain_ticks(axes.yaxis)
    title = "median of 1 to 50 million, and range" if (c["particles"] >= LARGE[0]).any() else None
    for axes in (left, right):
        axes.legend(fontsize=8, frameon=False, title=title, title_fontsize=8)
    fits = " × does not fit." if (c["outcome"] == "does not fit").any() else ""
    recordings = ", ".join(sorted(set(c["recording"].tolist())))
    figure.suptitle(f"{about['device']}. {recordings}, refined 0 to {c['refined'].max()} times (eight particles for "
                    f"one). Bands: ±{100 * BAND:.0f} %.{fits}", fontsize=9)
    save(figure, folder, "by-size")


def family(name):
    """Backend, interval and skin of a list with a fixed interval, else the backend alone."""
    found = re.fullmatch(r"list:rebuild=(\d+):skin=([0-9.]+)", name)
    return ("list", int(found[1]), float(found[2])) if found else (name.partition(":")[0], None, None)


def color_of(name):
    backend, interval, skin = family(name)
    return COLORS.get(backend, OTHER) if interval is None else FIXED.get(skin, OTHER)


def mark(axes, x, y, name, conforms, size=5):
    color = color_of(name)
    axes.plot(x, y, "o" if family(name)[1] is None else "s", ms=size, color=color, mfc=color if conforms else "white")


def stretches(times):
    """The axis of time in one part, or in two where the slow sets are far from the others: limits of each."""
    times = np.sort(times)
    gaps = times[1:] / times[:-1]
    late = len(times) * 2 // 3  # before it no gap splits the axis
    if len(times) < 9 or gaps[late:].max() < 1.5:
        return [(times[0] / 1.1, times[-1] * 1.1)]
    split = late + int(np.argmax(gaps[late:]))
    return [(times[0] / 1.1, times[split] * 1.1), (times[split + 1] / 1.3, times[-1] * 1.3)]


def draw_scores(axes, c):
    score = np.minimum(c["score"], MOST)
    conforms = c["verdict"] == "conforms"
    for name, x, y, good in zip(c["option_set"], c["substep_us"], score, conforms):
        mark(axes, x, y, name, good)
    families = [family(name) for name in c["option_set"]]
    skins = sorted({f[2] for f in families if f[1] is not None})
    for skin, (dx, dy, side) in zip(skins, [(-5, -2, "right"), (0, 4, "center"), (5, -2, "left")] * len(skins)):
        of = sorted((f[1], k) for k, f in enumerate(families) if f[2] == skin)
        line = [k for _, k in of]
        axes.plot(c["substep_us"][line], score[line], lw=0.9, color=FIXED.get(skin, OTHER), zorder=0)
        for interval, k in of:
            if not conforms[k]:
                axes.annotate(interval, (c["substep_us"][k], score[k]), xytext=(dx, dy), textcoords="offset points",
                              ha=side, fontsize=7, color=FIXED.get(skin, OTHER), annotation_clip=True)
    axes.axhline(1, color="black", lw=1)
    axes.axhline(np.nanmax(c["fp32_reference_score"]), color="#999999", lw=0.8, ls=":")
    axes.set_yscale("log")


def name_lines(axes, c):
    fp32 = np.nanmax(c["fp32_reference_score"])
    axes.text(0.98, 1.15, "above: does not conform", transform=axes.get_yaxis_transform(), ha="right", va="bottom",
              fontsize=8)
    axes.text(0.98, 0.7 * fp32, f"sequential fp32: {fp32:.2g}", transform=axes.get_yaxis_transform(), ha="right",
              va="top", fontsize=8, color="#666666")


def untimed_scores(c, rounded):
    """What has a score and no time: names and scores, the highest first."""
    found = [(f"{name}: {what}", score) for name, what, score in zip(*(rounded[k] for k in ("name", "what", "score")))]
    found += [(c["option_set"][k], c["score"][k]) for k in np.flatnonzero(np.isnan(c["substep_us"]))]
    return sorted(found, key=lambda one: -one[1])


def draw_untimed(axes, untimed):
    """At the right edge, one below the other."""
    low, high = np.log10(axes.get_ylim())
    place = 1.03
    for name, score in untimed:
        y = min(score, 10**high)
        place = min((np.log10(y) - low) / (high - low), place - 0.07)
        value = "no bound" if score > MOST else f"{score:.3g}"
        axes.annotate(textwrap.fill(f"{value}, {name}", 40), (1, y), (1.06, place), fontsize=7, va="center",
                      xycoords=axes.get_yaxis_transform(), textcoords="axes fraction", annotation_clip=False,
                      arrowprops={"arrowstyle": "-", "lw": 0.6, "color": OTHER, "relpos": (0, 0.5)})
    axes.text(1.06, 1.03, "a score alone, no time:", transform=axes.transAxes, fontsize=8, va="bottom")


def draw_names(axes, c, order):
    conforms = c["verdict"] == "conforms"
    for place, k in enumerate(order):
        name = c["option_set"][k]
        axes.plot([c["fastest_us"][k], c["slowest_us"][k]], [place, place], lw=1, color=color_of(name))
        mark(axes, c["substep_us"][k], place, name, conforms[k])
    axes.set_yticks(range(len(order)), c["option_set"][order], fontsize=7)
    for label, k in zip(axes.get_yticklabels(), order):
        label.set_color("black" if conforms[k] else "#e45756")
    axes.set_ylim(-0.8, len(order) - 0.2)
    axes.grid(axis="y", lw=0.3, color="#dddddd")
    axes.set_axisbelow(True)


def legend(figure, axes, c, title):
    families = [family(name) for name in c["option_set"]]
    for backend in dict.fromkeys(f[0] for f in families if f[1] is None):
        label = {"list": "list, rebuilt before a pair is missed"}.get(backend, backend)
        axes.plot([], [], "o", color=COLORS.get(backend, OTHER), label=label)
    for skin in sorted({f[2] for f in families if f[1] is not None}):
        axes.plot([], [], "s-", color=FIXED.get(skin, OTHER), label=f"list, every N (beside) substeps, skin {skin:g} H")
    axes.plot([], [], "o", color="black", mfc="white", label="does not conform, or misses pairs")
    figure.legend(*axes.get_legend_handles_labels(), fontsize=8, frameon=False, ncols=3, loc="outside upper left",
                  title=title, title_fontsize=9, alignment="left")


def by_error(file, folder):
    c, about = columns_of(file), provenance_of(file)
    rounded = columns_of(file["rounded"]) if "rounded" in file else {"name": [], "what": [], "score": []}
    untimed = untimed_scores(c, rounded)
    timed = np.flatnonzero(np.isfinite(c["substep_us"]))
    order = timed[np.argsort(-c["substep_us"][timed], kind="stable")]
    parts = stretches(c["substep_us"][timed])
    figure, grid = plt.subplots(2, len(parts), figsize=(12, 6 + 0.16 * len(order)), sharex="col", sharey="row",
                                squeeze=False, layout="constrained", gridspec_kw={
                                    "height_ratios": (5.5, 0.16 * len(order) + 0.5), "wspace": 0.02,
                                    "width_ratios": (5, 1.5)[:len(parts)]})
    for k, limits in enumerate(parts):
        draw_scores(grid[0][k], c)
        draw_names(grid[1][k], c, order)
        for axes in grid[:, k]:
            axes.set(xscale="log", xlim=limits)
            axes.spines["left"].set_linestyle("-" if k == 0 else ":")
            axes.tick_params(axis="y", which="both", left=k == 0)
        plain_ticks(grid[1][k].xaxis, most=3 if k else 15)
    shown = np.minimum([1, *c["score"], *(score for _, score in untimed)], MOST)
    grid[0][0].set_ylim(0.2 * min(shown.min(), np.nanmax(c["fp32_reference_score"])), 5 * shown.max())
    grid[0][0].set_ylabel("largest score, |error| / tolerance")
    grid[1][0].set_xlabel("µs per substep: median of the windows, fastest to slowest")
    name_lines(grid[0][0], c)
    if untimed:
        draw_untimed(grid[0][-1], untimed)
    legend(figure, grid[0][0], c,
           f"{about['recording']}, {int(about['particles']):,} particles, {about['device']}")
    save(figure, folder, "by-error")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="of cost_by_size.py and cost_by_error.py")
    parser.add_argument("--out", type=Path, required=True, help="folder for the pictures")
    arguments = parser.parse_args()
    drawn = []
    arguments.out.mkdir(parents=True, exist_ok=True)
    for name, kind, draw in (("size", "decant_cost_by_size", by_size), ("error", "decant_cost_by_error", by_error)):
        path = arguments.folder / f"{name}.h5"
        if path.is_file():
            with open_hdf5(path, [kind], f"a table of cost_by_{name}.py") as file:
                draw(file, arguments.out)
            drawn.append(str(arguments.out / f"by-{name}.png"))
    if not drawn:
        refuse(f"{arguments.folder}: neither size.h5 nor error.h5")
    print(", ".join(drawn))


if __name__ == "__main__":
    run_main(main)
