#!/usr/bin/env python3
"""Records the fixtures fixtures/hostile-*.h5: states that nobody pours but ports break on."""

import argparse
import subprocess
import tempfile
from pathlib import Path

import h5py
import numpy as np


def tilted(x):
    """Points of the upright cup of hostile-cup.json where it stands after 0.2 s, at half its tilt."""
    axis, angle, pivot = np.array([0.36, 0.8, 0.48]), np.radians(30), np.array([-0.28, -0.2, -0.22])
    x = x + [-0.3, -0.2, -0.25] - pivot
    along = x @ axis
    return (pivot + x * np.cos(angle) + np.cross(axis, x) * np.sin(angle)
            + np.outer(along, axis) * (1 - np.cos(angle)))


def cup(rng, n, reach=0.016, low=0.003, high=0.023):
    """n points in the tilted cup, at least 0.7 dx apart; inner radius 0.02, bottom at 0."""
    dx, points = 0.004, []
    while len(points) < n:
        r, angle, z = reach * np.sqrt(rng.random()), 2 * np.pi * rng.random(), rng.uniform(low, high)
        x = np.array([r * np.cos(angle), r * np.sin(angle), z])
        if all(np.sum((x - y) ** 2) > (0.7 * dx) ** 2 for y in points):
            points.append(x)
    return tilted(np.array(points))


def states(rng):
    """(name, scene, positions): each a way in which a port breaks."""
    yield "empty", "hostile-cup", np.zeros((0, 3))
    yield "one-particle", "hostile-cup", tilted(np.array([[0.0, 0.0, 0.009]]))

    twins = cup(rng, 120)
    twins[1], twins[3], twins[4] = twins[0], twins[2], twins[2]
    yield "coincident", "hostile-cup", twins

    # On the faces of cells of size H and H/2, counted from the origin and from the domain's corner.
    faces = cup(rng, 150)
    H = 0.008
    for k, cell in enumerate((H, H / 2)):
        faces[k::4, k] = np.round(faces[k::4, k] / cell) * cell
        faces[k + 2::4, 0] = -50 + np.round((faces[k + 2::4, 0] + 50) / cell) * cell
    yield "cell-faces", "hostile-cup", faces

    outliers = cup(rng, 150)
    outliers[7], outliers[80] = [49.5, -49.25, 0.9], [-49.9, 49.5, -0.45]
    yield "outliers", "hostile-cup", outliers

    # Some in the solid, some about to touch it, most in the fluid.
    yield "in-walls", "hostile-cup", cup(rng, 200, reach=0.024, low=-0.003)

    # Some three times as dense as water in the middle of a loose fluid.
    crowd = rng.normal(size=(260, 3))
    crowd *= (0.0095 * rng.random((260, 1)) ** (1 / 3)) / np.linalg.norm(crowd, axis=1, keepdims=True)
    loose = np.stack(np.meshgrid(*[np.arange(0.004, 0.06, 0.0065)] * 3), -1).reshape(-1, 3)
    loose += rng.uniform(-0.001, 0.001, loose.shape)
    middle = np.array([0.03, 0.03, 0.03])
    loose = loose[np.linalg.norm(loose - middle, axis=1) > 0.013]
    for k in range(72):  # about to touch one of the six faces, or in it
        loose[k, k % 3] = (0.00127, 0.06 - 0.00127, -0.001, 0.0615)[k % 4]
    yield "crowd", "hostile-tank", np.concatenate([crowd + middle, loose])

    spread = np.stack(np.meshgrid(np.arange(10), np.arange(9), np.arange(12)), -1).reshape(-1, 3)
    spread = (spread + 0.5 + rng.uniform(-0.3, 0.3, spread.shape)) * 0.001 + [-0.003, 0, 0]
    spread[1] = spread[0]
    yield "periodic", "hostile-channel", spread

    tumbling = np.stack(np.meshgrid(*[np.arange(8)] * 3), -1).reshape(-1, 3)
    tumbling = (tumbling + 0.5 + rng.uniform(-0.3, 0.3, tumbling.shape)) * 0.01 - 0.04
    yield "periodic-box", "hostile-box", tumbling

    lattice = np.stack(np.meshgrid(*[np.arange(-4, 4)] * 3), -1).reshape(-1, 3)
    yield "exact-support", "hostile-exact", lattice * 2.0**-8


def main():
    p = argparse.ArgumentParser(description=__doc__)
    p.add_argument("--decant", default="build/release/bin/decant", help="the command")
    p.add_argument("--fixtures", type=Path, default=Path("fixtures"))
    p.add_argument("--only", nargs="*", help="names")
    a = p.parse_args()
    for name, scene, position in states(np.random.default_rng(20250726)):
        if a.only and name not in a.only:
            continue
        velocity = np.random.default_rng(7).uniform(-0.2, 0.2, position.shape)
        with tempfile.TemporaryDirectory() as folder:
            state = Path(folder) / f"{name}.h5"
            with h5py.File(state, "w", libver="v108") as f:
                f["position"], f["velocity"] = position, velocity
                f.attrs["time"] = time = 0.2 if scene == "hostile-cup" else 0.0
            subprocess.run([a.decant, "record", a.fixtures / "scenes" / f"{scene}.json", "--from", state,
                            "--phase", f"{name}={time}", "--out", a.fixtures / f"hostile-{name}.h5", "--quiet"],
                           check=True)


if __name__ == "__main__":
    main()
