#!/usr/bin/env python3
"""Draws a pour: phases side by side from frames.h5, or its timeline from timeline.h5.

    render_pour.py build/pour-4k --out pour.png --times 0.3,1.0,1.6,2.2,4.0
    render_pour.py build/pour-4k --out timeline.png --timeline

Of a pour that is not complete it draws the frames that are, and says how many. Walls are cut in the plane
y = 0 where that goes through the fluid, else in the middle of the fluid or of a container. Needs numpy, h5py and
matplotlib (build/venv has them).
"""
import argparse
import json
import pathlib

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402

from one_line import open_hdf5, refuse, run_main  # noqa: E402

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


def middle(y):
    return 0.5 * (float(y.min()) + float(y.max()))


def cutting_plane(file, chosen, position):
    """The y at which walls are cut: 0 where the fluid is on both sides of it, else the middle of the fluid, else
    that of the first container that can be cut there."""
    y = np.concatenate(position)[:, 1]
    planes = [0.0] if not len(y) or y.min() < 0 < y.max() else []
    planes += [float(np.median(y))] if len(y) else []
    for wall in file.get("walls", {}).values():
        vertex = wall["vertex"]
        planes.append(middle((vertex[chosen[0]] if vertex.ndim == 3 else vertex[:])[:, 1]))
    for plane in planes:
        if any(len(s) for f in chosen for s in wall_segments(file, f, plane)):
            return plane
    return planes[0]


def open_frames(folder):
    """The pour's frames, open, and which of them are complete."""
    if not folder.is_dir():
        refuse(f"{folder}: not a folder; a pour's --out is needed")
    path = folder / "frames.h5"
    if not path.exists() and (folder / "frames.h5.partial").exists():
        path = folder / "frames.h5.partial"
    file = open_hdf5(path, ["backend"], "the frames of a pour")
    for name in ("scene", "time", "fluid/position", "fluid/velocity"):
        if name not in file:
            refuse(f"{path}: not the frames of a pour: no /{name}")
    # A frame's time is written after all else of it.
    complete = np.flatnonzero(np.isfinite(file["time"][:]))
    if not len(complete):
        refuse(f"{path}: no frame is complete yet")
    if len(complete) < len(file["time"]):
        print(f"{path}: {len(complete)} of {len(file['time'])} frames are complete, "
              f"up to t = {file['time'][complete[-1]]:.4g} s")
    return file, complete


def phases(file, complete, times, count):
    """Frames to draw: the nearest to the times asked for, else evenly spread."""
    if times:
        time = file["time"][:][complete]
        return [int(complete[np.argmin(np.abs(time - t))]) for t in times]
    spread = np.linspace(0, len(complete) - 1, min(count, len(complete))).round()
    return [int(complete[int(k)]) for k in spread]


def view_of(everything):
    """Corners (x, z) of what is drawn with a margin, no more than three times as high as wide, nor the reverse:
    one particle that flew off is not to make the picture meters high."""
    low = np.min([e.min(axis=0) for e in everything], axis=0)
    high = np.max([e.max(axis=0) for e in everything], axis=0)
    extent = high - low
    margin = 0.04 * extent.max() or 0.01
    wanted = np.maximum(extent + 2 * margin, (extent.max() + 2 * margin) / 3)
    centre = 0.5 * (low + high)
    return centre - 0.5 * wanted, centre + 0.5 * wanted


def draw_phases(folder, out, times, count, plane, slab, dpi):
    """One panel a phase. plane: y where walls are cut, m; None: chosen. slab: half thickness about it of the
    particles shown, m; None: all of them."""
    file, complete = open_frames(folder)
    with file:
        chosen = phases(file, complete, times, count)
        time = file["time"][:]
        position = [file["fluid/position"][f] for f in chosen]
        speed = [np.linalg.norm(file["fluid/velocity"][f], axis=1) for f in chosen]
        if plane is None:
            plane = cutting_plane(file, chosen, position)
            if plane != 0:
                print(f"walls are cut at y = {plane:.4g} m; --plane cuts them elsewhere")
        walls = [wall_segments(file, f, plane) for f in chosen]
        spacing = json.loads(file["scene"][()])["particle_spacing"]
    everything = [p[:, (0, 2)] for p in position] + [s.reshape(-1, 2) for w in walls for s in w]
    everything = [e for e in everything if len(e)]
    if not everything:
        refuse(f"{folder}: no particle, and no wall at y = {plane:.4g} m; give another with --plane")
    low, high = view_of(everything)
    fastest = max(float(np.percentile(s, 99.5)) if len(s) else 0.0 for s in speed) or 1.0

    width = 2.6
    height = width * (high[1] - low[1]) / (high[0] - low[0])
    figure, axes = plt.subplots(1, len(chosen), figsize=(width * len(chosen) + 0.8, height + 0.75),
                                sharey=True, squeeze=False, layout="constrained")
    for axis, f, p, s, w in zip(axes[0], chosen, position, speed, walls):
        shown = np.abs(p[:, 1] - plane) <= slab if slab else np.ones(len(p), bool)
        order = np.argsort(p[shown, 1])[::-1]
        points_per_metre = 72 * width / (high[0] - low[0])
        # A particle is drawn about as large as it is.
        dots = axis.scatter(100 * p[shown][order, 0], 100 * p[shown][order, 2],
                            c=s[shown][order], s=max(0.4, (points_per_metre * spacing) ** 2),
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


def open_timeline(folder):
    """The pour's timeline, or what its last checkpoint has of it: the open file, and the group of the columns."""
    if not folder.is_dir():
        refuse(f"{folder}: not a folder; a pour's --out is needed")
    path = folder / "timeline.h5"
    if path.exists() or not (folder / "checkpoint.h5").exists():
        file = open_hdf5(path, ["backend"], "the timeline of a pour")
        rows = file
    else:
        path = folder / "checkpoint.h5"
        file = open_hdf5(path, ["scene_sha256"], "the checkpoint of a pour")
        rows = file["timeline"]
        print(f"{path}: the pour is not complete, its timeline goes up to t = {rows['time'][-1]:.4g} s")
    if "mass" not in rows:
        refuse(f"{path}: not the timeline of a pour: no /mass")
    return file, rows


def draw_timeline(folder, out, dpi):
    """Mass by place over time, and kinetic energy below it."""
    file, rows = open_timeline(folder)
    with file:
        time = rows["time"][:]
        mass = {place: 1e3 * rows["mass"][place][:] for place in PLACES}
        kinetic = 1e3 * rows["kinetic_energy"][:]
        speed = rows["max_speed"][:]
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
    parser.add_argument("--plane", type=float, help="y at which walls are cut, m; else through the fluid")
    parser.add_argument("--slab", type=float, help="show particles up to this far from the plane, m")
    parser.add_argument("--timeline", action="store_true", help="draw timeline.h5 instead")
    parser.add_argument("--dpi", type=int, default=110)
    a = parser.parse_args()
    if a.timeline:
        draw_timeline(a.folder, a.out, a.dpi)
    else:
        try:
            times = [float(t) for t in a.times.split(",")] if a.times else None
        except ValueError:
            parser.error(f"--times {a.times}: seconds, comma-separated")
        draw_phases(a.folder, a.out, times, a.phases, a.plane, a.slab, a.dpi)


if __name__ == "__main__":
    run_main(main)
