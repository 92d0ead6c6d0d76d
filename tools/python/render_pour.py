#!/usr/bin/env python3
"""Draws a pour: phases side by side from frames.h5, or its timeline from timeline.h5.

    render_pour.py build/pour-4k --out pour.png --times 0.3,1.0,1.6,2.2,4.0
    render_pour.py build/pour-4k --out timeline.png --timeline

Needs numpy, h5py and matplotlib (build/venv has them).
"""
import argparse
import pathlib
import sys

import h5py
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402

from one_line import run_main  # noqa: E402

PLACES = ("source", "in_flight", "receiver", "spilled", "lost")
INK = "#26303a"


def cross_section(vertex, triangle, y=0.0):
    """Segments [S,2,2] in (x, z), m, where the triangles meet the plane at height y."""
    corner = vertex[triangle]  # F,3,3
    # A vertex on the plane would count twice or not at all.
    side = corner[:, :, 1] - y
    side = np.where(side == 0, 1e-12, side)
    crossing = []
    for a, b in ((0, 1), (1, 2), (2, 0)):
        meets = side[:, a] * side[:, b] < 0
        share = np.divide(side[:, a], side[:, a] - side[:, b], where=meets, out=np.zeros(len(meets)))
        point = corner[:, a] + share[:, None] * (corner[:, b] - corner[:, a])
        crossing.append(np.where(meets[:, None], point[:, (0, 2)], np.nan))
    points = np.stack(crossing, axis=1)  # F,3,2, two of three are points
    cut = np.isfinite(points[:, :, 0]).sum(axis=1) == 2
    points = points[cut]
    return points[np.isfinite(points[:, :, 0])].reshape(-1, 2, 2)


def wall_segments(file, frame, y):
    """Segments of every container at one frame, in the plane at height y."""
    found = []
    for wall in file.get("walls", {}).values():
        vertex = wall["vertex"]
        at = vertex[frame] if vertex.ndim == 3 else vertex[:]
        found.append(cross_section(at.astype(float), wall["triangle"][:], y))
    return found


def phases(file, times, count):
    """Frames to draw: the nearest to the times asked for, else evenly spread."""
    time = file["time"][:]
    if not np.isfinite(time).all():
        sys.exit("render_pour: some frames are not written yet")
    if times:
        return [int(np.argmin(np.abs(time - t))) for t in times]
    return [int(f) for f in np.linspace(0, len(time) - 1, count).round()]


def draw_phases(folder, out, times, count, slab, dpi):
    """One panel a phase. slab: half thickness in y of the particles shown, m; None: all of them."""
    with h5py.File(folder / "frames.h5") as file:
        chosen = phases(file, times, count)
        time = file["time"][:]
        position = [file["fluid/position"][f] for f in chosen]
        speed = [np.linalg.norm(file["fluid/velocity"][f], axis=1) for f in chosen]
        walls = [wall_segments(file, f, 0.0) for f in chosen]
        if not any(len(s) for w in walls for s in w):  # a scene beside the plane: cut it where the fluid is
            y = float(np.median(np.concatenate(position)[:, 1]))
            walls = [wall_segments(file, f, y) for f in chosen]
    everything = [p[:, (0, 2)] for p in position] + [s.reshape(-1, 2) for w in walls for s in w]
    everything = [e for e in everything if len(e)]
    if not everything:
        sys.exit("render_pour: no particle and no wall to draw")
    low = np.min([e.min(axis=0) for e in everything], axis=0)
    high = np.max([e.max(axis=0) for e in everything], axis=0)
    margin = 0.04 * (high - low).max()
    low, high = low - margin, high + margin
    fastest = max(float(np.percentile(s, 99.5)) for s in speed) or 1.0

    width = 2.6
    height = width * (high[1] - low[1]) / (high[0] - low[0])
    figure, axes = plt.subplots(1, len(chosen), figsize=(width * len(chosen) + 0.8, height + 0.75),
                                sharey=True, squeeze=False, layout="constrained")
    for axis, f, p, s, w in zip(axes[0], chosen, position, speed, walls):
        shown = np.abs(p[:, 1]) <= slab if slab else np.ones(len(p), bool)
        order = np.argsort(p[shown, 1])[::-1]
        points_per_metre = 72 * width / (high[0] - low[0])
        # A particle is drawn about as large as it is.
        dots = axis.scatter(100 * p[shown][order, 0], 100 * p[shown][order, 2],
                            c=s[shown][order], s=max(0.4, (points_per_metre * spacing_of(p)) ** 2),
                            cmap="viridis", vmin=0, vmax=fastest, linewidths=0)
        for segments in w:
            axis.plot(100 * segments[:, :, 0].T, 100 * segments[:, :, 1].T, color=INK, lw=1.1,
                      solid_capstyle="round")
        axis.set_title(f"t = {time[f]:.2f} s", fontsize=11, color=INK)
        axis.set_xlim(100 * low[0], 100 * high[0])
        axis.set_ylim(100 * low[1], 100 * high[1])
        axis.set_aspect("equal")
        axis.set_xlabel("x, cm", fontsize=9)
        axis.tick_params(labelsize=8)
        axis.spines[["top", "right"]].set_visible(False)
    axes[0][0].set_ylabel("z, cm", fontsize=9)
    bar = figure.colorbar(dots, ax=axes, fraction=0.02, pad=0.01, shrink=0.8)
    bar.set_label("speed, m/s", fontsize=9)
    bar.ax.tick_params(labelsize=8)
    save(figure, out, dpi)


def spacing_of(position):
    """Distance of a particle's nearest neighbor, m: the median of a few hundred particles."""
    some = position[:: max(1, len(position) // 300)]
    squared = ((some[:, None, :] - position[None, :, :]) ** 2).sum(axis=2)
    return float(np.sqrt(np.median(np.partition(squared, 1, axis=1)[:, 1])))


def draw_timeline(folder, out, dpi):
    """Mass by place over time, and kinetic energy below it."""
    with h5py.File(folder / "timeline.h5") as file:
        time = file["time"][:]
        mass = {place: 1e3 * file["mass"][place][:] for place in PLACES}
        kinetic = 1e3 * file["kinetic_energy"][:]
        speed = file["max_speed"][:]
    figure, (upper, lower) = plt.subplots(2, 1, figsize=(7.5, 5.4), sharex=True,
                                          layout="constrained")
    colours = dict(zip(PLACES, ("#3b6ea5", "#e08a1e", "#2f8f6b", "#b23a48", "#777777")))
    for place in PLACES:
        if mass[place].max() == 0:
            continue
        upper.plot(time, mass[place], color=colours[place], lw=1.8,
                   label=f"{place.replace('_', ' ')}, {mass[place][-1]:.1f} g at the end")
    upper.set_ylabel("mass, g")
    upper.legend(frameon=False, fontsize=9)
    lower.plot(time, kinetic, color=INK, lw=1.6)
    lower.set_ylabel("kinetic energy, mJ")
    lower.set_xlabel("t, s")
    fastest = lower.twinx()
    fastest.plot(time, speed, color="#e08a1e", lw=1.0, alpha=0.8)
    fastest.set_ylabel("largest speed, m/s", color="#b06a10")
    for axis in (upper, lower, fastest):
        axis.spines["top"].set_visible(False)
        axis.tick_params(labelsize=9)
    upper.spines["right"].set_visible(False)
    save(figure, out, dpi)


def save(figure, out, dpi):
    """Writes a PNG below 250 kB, coarser where it must be."""
    while True:
        figure.savefig(out, dpi=dpi)
        size = pathlib.Path(out).stat().st_size
        if size < 250_000 or dpi < 40:
            break
        dpi = int(0.85 * dpi)
    print(f"{out}: {size // 1000} kB")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=pathlib.Path, help="the pour's --out")
    parser.add_argument("--out", required=True, help="PNG to write")
    parser.add_argument("--times", help="seconds, comma-separated; else evenly spread")
    parser.add_argument("--phases", type=int, default=5, help="how many, without --times")
    parser.add_argument("--slab", type=float, help="show particles with |y| up to this, m")
    parser.add_argument("--timeline", action="store_true", help="draw timeline.h5 instead")
    parser.add_argument("--dpi", type=int, default=110)
    a = parser.parse_args()
    if a.timeline:
        draw_timeline(a.folder, a.out, a.dpi)
    else:
        times = [float(t) for t in a.times.split(",")] if a.times else None
        draw_phases(a.folder, a.out, times, a.phases, a.slab, a.dpi)


if __name__ == "__main__":
    run_main(main)
