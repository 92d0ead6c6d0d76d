#!/usr/bin/env python3
"""Draws what profile_pour.py gathered, as pictures and a page: occupancy and active lanes over the pour, stages by
strategy, speed-up of the sums alone, sectors and their excess, a roofline, and the published study's figures beside.

    plot_profile.py profile.h5 --out FOLDER
"""

import argparse
from pathlib import Path

import numpy as np

from figures import plt, save
from one_line import open_hdf5, run_main
from study_runs import columns_of, provenance_of

# Of an H200: fp32 TFLOP/s and DRAM TB/s that NVIDIA states.
PEAK_FLOPS, PEAK_BYTES = 67e12, 4.8e12
NAMES = {"brute": "brute", "hash:launch=stream": "hash", "list:launch=stream": "list, auto",
         "hash:wall_cells=off:sort=thrust:force_neighbors=recomputed": "hash: cells of the fluid alone",
         "hash:moving_walls=rebuilt:sort=thrust:force_neighbors=recomputed": "hash: walls sorted each substep",
         "hash:sort=thrust:force_neighbors=recomputed": "hash: walls in their frame",
         "list:rebuild=1:launch=stream": "list, every substep",
         "list:rebuild=10:skin=0:launch=stream": "list, every 10"}
STAGES = ("build", "density", "force", "integrate")
COLORS = dict(zip(NAMES, plt.cm.tab10.colors))


def stage_of(kernel):
    for stage in STAGES[1:]:
        if kernel.startswith(f"{stage}_kernel"):
            return stage
    return "build"


class Profile:
    """Columns of the file; `of` gives those of one backend, stage and frame."""

    def __init__(self, path):
        with open_hdf5(path, ["decant_profile"], "a profile of profile_pour.py") as file:
            self.columns, self.about = columns_of(file), provenance_of(file)
        self.columns["stage"] = np.array([stage_of(kernel) for kernel in self.columns["kernel"]])
        self.backends = [b for b in NAMES if b in self.columns["backend"]]

    def of(self, backend, stage, frame=None):
        c = self.columns
        chosen = (c["backend"] == backend) & (c["stage"] == stage)
        if frame is not None:
            chosen &= c["frame"] == frame
        return {name: values[chosen] for name, values in c.items()}

    def frames(self, backend):
        return np.unique(self.columns["frame"][self.columns["backend"] == backend])

    def common_frame(self):
        """The middle one of the frames that all backends have."""
        common = sorted(set.intersection(*(set(self.frames(b)) for b in self.backends)))
        return common[len(common) // 2]


def over_frames(profile, folder):
    figure, grid = plt.subplots(2, 2, figsize=(11, 7), constrained_layout=True, sharex=True)
    for row, (counter, label) in enumerate((("occupancy_achieved", "achieved occupancy, %"),
                                            ("active_lanes", "active lanes of 32"))):
        for axes, stage in zip(grid[row], ("density", "force")):
            for backend in profile.backends:
                found = profile.of(backend, stage)
                order = np.argsort(found["frame"])
                axes.plot(found["frame"][order], found[counter][order], "o-", ms=3, color=COLORS[backend],
                          label=NAMES[backend])
            axes.set_title(stage, fontsize=10)
            axes.set_ylabel(label)
            axes.set_ylim(0)
    grid[1][0].set_xlabel("frame")
    grid[1][1].set_xlabel("frame")
    grid[0][1].legend(fontsize=7)
    save(figure, folder, "over-frames")


def bars(profile, folder):
    frame = profile.common_frame()
    places = np.arange(len(profile.backends))
    labels = [NAMES[b] for b in profile.backends]
    figure, (left, right) = plt.subplots(1, 2, figsize=(13, 5), constrained_layout=True)
    for k, (stage, color) in enumerate(zip(STAGES, plt.cm.Set2.colors)):
        times = [profile.of(b, stage, frame)["time"].sum() for b in profile.backends]
        left.bar(places + 0.2 * (k - 1.5), times, 0.2, color=color, label=stage)
    left.set_yscale("log")
    left.set_ylabel("µs in a substep that builds")
    left.legend(fontsize=8)
    sums = {b: sum(profile.of(b, s, frame)["time"].sum() for s in ("density", "force")) for b in profile.backends}
    right.bar(places, [sums["brute"] / sums[b] for b in profile.backends], color="#4c78a8")
    for place, b in zip(places, profile.backends):
        gain = sums["brute"] / sums[b]
        right.text(place, gain, f"{gain:.0f}×" if gain >= 10 else f"{gain:.2g}×", ha="center", va="bottom", fontsize=8)
    right.set_yscale("log")
    right.set_ylabel("density + force: times faster than brute's")
    for axes in (left, right):
        axes.set_xticks(places, labels, rotation=30, ha="right", fontsize=8)
    figure.suptitle(f"frame {frame}", fontsize=10)
    save(figure, folder, "stages")

    figure, (left, right) = plt.subplots(1, 2, figsize=(13, 5), constrained_layout=True)
    for shift, stage in ((-0.2, "density"), (0.2, "force")):
        found = [profile.of(b, stage, frame) for b in profile.backends]
        left.bar(places + shift, [f["l1_sectors"].sum() / 1e6 for f in found], 0.4, label=stage)
        right.bar(places + shift, [f["excessive_share"].mean() for f in found], 0.4, label=stage)
    left.set_yscale("log")
    left.set_ylabel("million sectors loaded from global memory")
    right.set_ylabel("excessive sectors, %")
    left.legend(fontsize=8)
    for axes in (left, right):
        axes.set_xticks(places, labels, rotation=30, ha="right", fontsize=8)
    save(figure, folder, "sectors")


def roofline(profile, folder):
    frame = profile.common_frame()
    figure, axes = plt.subplots(figsize=(9, 6), constrained_layout=True)
    intensity = np.logspace(-1, 5, 100)
    axes.loglog(intensity, np.minimum(PEAK_FLOPS, intensity * PEAK_BYTES), "k-", lw=1)
    for backend in profile.backends:
        for stage, marker in (("density", "o"), ("force", "s"), ("build", "^"), ("integrate", "v")):
            found = profile.of(backend, stage, frame)
            flops = 2 * found["ffma"] + found["fadd"] + found["fmul"]
            some = (flops > 0) & (found["dram_bytes"] > 0)
            axes.plot(flops[some] / (found["dram_bytes"][some] * 1e6), flops[some] / (found["time"][some] * 1e-6),
                      marker, color=COLORS[backend], ms=5, label=NAMES[backend] if stage == "density" else None)
    axes.set_xlabel("fp32 operations per byte of DRAM")
    axes.set_ylabel("fp32 operations per s")
    axes.set_title("density ●, force ■, build ▲, integrate ▼; line: peaks that NVIDIA states", fontsize=10)
    axes.legend(fontsize=7)
    save(figure, folder, "roofline")


LADDER = "hash:sort=thrust:force_neighbors=recomputed"  # its last rung
PUBLISHED = [  # what, published, backend, stage, counter, unit
    ("hash, registers of density", "46", LADDER, "density", "registers", ""),
    ("hash, registers of force", "58", LADDER, "force", "registers", ""),
    ("hash, sectors of density", "42 M", LADDER, "density", "l1_sectors", "M"),
    ("hash, excessive sectors", "1 %", LADDER, "density", "excessive_share", "%"),
    ("hash, occupancy, peak", "63 %", LADDER, "density", "occupancy_achieved", "%"),
    ("list, sectors of density", "16.5 M", "list:launch=stream", "density", "l1_sectors", "M"),
    ("list, excessive sectors", "87 %", "list:launch=stream", "density", "excessive_share", "%"),
    ("list, occupancy", "90 %", "list:launch=stream", "density", "occupancy_achieved", "%"),
]


def table(profile):
    frame = profile.common_frame()
    lines = ["| | published, RTX 2080 | here |", "|---|---|---|"]
    for what, theirs, backend, stage, counter, unit in PUBLISHED:
        found = profile.of(backend, stage, frame)
        value = found[counter].sum() / 1e6 if unit == "M" else found[counter].max()
        text = f"{value:.1f}{' ' + unit if unit else ''}" if unit else f"{value:.0f}"
        if counter == "occupancy_achieved":
            text += f" of {found['occupancy_theoretical'].max():.0f} % that registers allow"
        lines.append(f"| {what} | {theirs} | {text} |")
    for backend in (LADDER, "hash:launch=stream", "list:launch=stream", "brute"):
        for stage in ("density", "force"):
            found = profile.of(backend, stage)
            a, lanes = found["occupancy_achieved"], found["active_lanes"]
            drop = "fall of 20 to 30 % while pouring, frames 100 to 410" if backend != "brute" else ""
            lines.append(f"| {NAMES[backend]}, {stage}: occupancy and lanes over the pour | {drop} | "
                         f"{a.min():.1f} to {a.max():.1f} %, a fall of {100 * (1 - a.min() / a.max()):.0f} %; "
                         f"{lanes.min():.1f} to {lanes.max():.1f} of 32 |")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("profile", help="profile.h5 of profile_pour.py")
    parser.add_argument("--out", type=Path, required=True, help="folder for the pictures")
    arguments = parser.parse_args()
    profile = Profile(arguments.profile)
    arguments.out.mkdir(parents=True, exist_ok=True)
    over_frames(profile, arguments.out)
    bars(profile, arguments.out)
    roofline(profile, arguments.out)
    print(f"{profile.about['device']}, revision {profile.about['git_revision']}, {profile.about['scene']}, "
          f"frame {profile.common_frame()} where no other is named\n")
    print(table(profile))


if __name__ == "__main__":
    run_main(main)
