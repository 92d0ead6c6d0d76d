#!/usr/bin/env python3
"""Records the fixtures fixtures/hostile-*.h5: states that nobody pours but ports break on."""

import argparse
import json
import subprocess
import tempfile
from pathlib import Path

import h5py
import numpy as np

from one_line import run_main


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


def scene_of(fixtures, name):
    text = (fixtures / "scenes" / f"{name}.json").read_text()
    return json.loads("\n".join(line for line in text.split("\n") if not line.strip().startswith("//")))


def to_world(container, time, x):
    """Points of a container's frame where they are at a time (s)."""
    x = x + np.array(container.get("origin", [0, 0, 0]))
    if "translation" in container:
        x = x + time * np.array(container["translation"]["velocity"])  # scenes here have no keys
    if "tilt" not in container:
        return x
    tilt = container["tilt"]
    times = [key["time"] for key in tilt["keys"]]
    angles = [key["angle"] if "angle" in key else np.radians(key["angle_deg"]) for key in tilt["keys"]]
    k = np.searchsorted(times, time, side="right")
    if k in (0, len(times)):
        angle = angles[min(k, len(times) - 1)]
    else:
        s = (time - times[k - 1]) / (times[k] - times[k - 1])
        angle = angles[k - 1] + (angles[k] - angles[k - 1]) * s * s * (3 - 2 * s)
    axis = np.array(tilt["axis"], float)
    axis, pivot = axis / np.linalg.norm(axis), np.array(tilt["pivot"])
    x = x - pivot
    return (pivot + x * np.cos(angle) + np.cross(axis, x) * np.sin(angle)
            + np.outer(x @ axis, axis) * (1 - np.cos(angle)))


def spread(rng, n, low, high, apart, inside=lambda x: True):
    """n points of a box that `inside` accepts, at least so far apart."""
    points = np.zeros((0, 3))
    while len(points) < n:
        x = rng.uniform(low, high)
        if inside(x) and (((points - x) ** 2).sum(1) > apart**2).all():
            points = np.concatenate([points, [x]])
    return points


def astray(rng, fixtures):
    """(name, time, positions) in scenes whose keys have no usual value."""
    # In the bowl and a little into its wall; on the floor where the outer wall leans over it.
    inner = spread(rng, 320, [-0.03, -0.03, -0.001], [0.03, 0.03, 0.03], 0.0036,
                   lambda x: np.hypot(x[0], x[1]) < 0.0125 + 0.633 * x[2])
    foot = spread(rng, 60, [-0.042, -0.042, -0.0165], [0.042, 0.042, -0.0095], 0.0032,
                  lambda x: 0.0295 < np.hypot(x[0], x[1]) < 0.04)
    yield "bowl", 0.0, np.concatenate([inner, foot])

    # Fluid near all faces, some of it in the walls, where the box stands between its third and fourth key.
    box = scene_of(fixtures, "hostile-tilted-box")["containers"][0]
    yield "tilted-box", 0.75, to_world(
        box, 0.75, spread(rng, 290, [-0.0007, -0.0007, -0.0007], [0.0327, 0.0247, 0.026], 0.0029))

    yield "belt", 0.0, spread(rng, 400, [0.004, -0.01, -0.0001], [0.02, 0.01, 0.0101], 0.0012)

    # About all four: through the hourglass, in the dish, on the shelf and under its lowest corner, round the plug.
    scene = scene_of(fixtures, "hostile-vessels")
    hourglass, dish, shelf, plug = scene["containers"]
    time, apart = 0.3, 0.0035
    corner = to_world(shelf, time, np.array([[x, y, z] for x in (-0.01, 0.025) for y in (-0.01, 0.03)
                                             for z in (-0.01, 0.02)]))
    lowest = corner[corner[:, 2].argmin()]
    floor = scene["floor"]["height"]
    yield "vessels", time, np.concatenate([
        to_world(hourglass, time, spread(rng, 60, [-0.017, -0.017, -0.003], [0.017, 0.017, 0.033], apart,
                                         lambda x: np.hypot(x[0], x[1]) < 0.017)),
        to_world(dish, time, spread(rng, 70, [-0.024, -0.024, 0.0005], [0.024, 0.024, 0.018], apart,
                                    lambda x: np.hypot(x[0], x[1]) < 0.012 + x[2])),
        to_world(shelf, time, spread(rng, 80, [-0.0005, -0.0005, -0.0005], [0.025, 0.02, 0.02], apart)),
        spread(rng, 14, [*(lowest[:2] - 0.006), floor - 0.0005], [*(lowest[:2] + 0.006), floor + 0.003], 0.0022),
        to_world(plug, time, spread(rng, 70, [-0.019, -0.019, -0.004], [0.019, 0.019, 0.025], apart,
                                    lambda x: np.hypot(x[0], x[1]) > 0.0135 or not 0.0005 < x[2] < 0.0195))])


def block(rng, counts, corner, apart=0.0042):
    """A jittered lattice with its first point at a corner."""
    x = np.stack(np.meshgrid(*[np.arange(n) for n in counts]), -1).reshape(-1, 3)
    return (x + rng.uniform(-0.1, 0.1, x.shape)) * apart + corner


def flying(rng, fixtures):
    """(name, scene, time, positions, velocities): states that need velocities of their own."""
    bouncing = block(rng, (6, 6, 4), [0.13, -0.008, 0.004])
    yield "bounce", "hostile-bounce", 0.0, bouncing, np.broadcast_to([0.4, 0.0, -2.2], bouncing.shape)

    jet = np.concatenate([block(rng, (5, 5, 5), [0.0415, -0.0084, -0.0084]),
                          block(rng, (2, 4, 4), [0.0285, -0.006, -0.006])])
    yield "post", "hostile-post", 0.0, jet, np.where(jet[:, :1] > 0.035, [[2.9, 0.1, 0.0]], [[0.0, 0.0, 0.0]])

    # As beside the fast wall, where it still moves by a small part of the skin in a substep.
    beside = block(rng, (4, 6, 5), [0.0365, -0.013, 0.012], 0.0052)
    yield "slow-wall", "hostile-fast-wall", 0.002, beside, np.zeros_like(beside)

    # What lists, of 5 substeps' way at this speed, have to find at the end of their time. Pairs that meet
    # head-on, far enough apart to be unlisted where lists are used too long; where one of them is when lists are made,
    # a slow particle.
    speed, dt = 2.5, 0.01 / 141
    middle = block(rng, (3, 3, 3), [0.06, -0.024, -0.02], 0.03)
    diagonal = np.ones(3) / 3**0.5
    half = 0.5 * (0.0116 + rng.uniform(-0.0001, 0.0001, (27, 1)))
    meeting = np.concatenate([middle - half * diagonal, middle + half * diagonal,
                              middle + (half - 5.85 * speed * dt) * diagonal + [0.00003, -0.00003, 0.0]])
    towards = np.repeat([speed, -speed, -0.1 * speed], 27)[:, None] * diagonal
    # And a sheet that leaves a cell of 0.6 H, as lists of walls have it, towards particles H beyond the cell.
    wall = scene_of(fixtures, "hostile-impact")["containers"][0]
    y, z = [g.ravel() for g in np.meshgrid((np.arange(0, 13, 2) + 0.5) * 0.05 / 13, np.arange(5) * 0.0085 + 0.01)]
    x = 0.0192003 - 25.5 * 0.5 * speed * dt - rng.uniform(0.00002, 0.00015, y.size)
    sheet = np.stack([x, y, z], -1) + wall["origin"]
    yield ("impact", "hostile-impact", 0.0, np.concatenate([meeting, sheet]),
           np.concatenate([towards, np.broadcast_to([0.5 * speed, 0.0, 0.0], sheet.shape)]))

    # What is sought from where it is, and lies in the cell of where it will be, which is three cells of 0.6 H away.
    angle = np.concatenate([a + rng.uniform(-0.1, 0.1, 13) for a in (0.0, np.pi)])
    outwards = np.stack([np.cos(angle), np.sin(angle), np.zeros(26)], -1)
    height = np.tile(np.linspace(-0.018, 0.018, 13), 2)[:, None] * [0.0, 0.0, 1.0]
    pairs = [0.00036, 0.0, 0.0] + (0.004516 - 4 * 1.45 * 0.01 / 135) * outwards + height
    yield "rebound", "hostile-rebound", 0.0, pairs, 1.45 * outwards


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

    channel = np.stack(np.meshgrid(np.arange(10), np.arange(9), np.arange(12)), -1).reshape(-1, 3)
    channel = (channel + 0.5 + rng.uniform(-0.3, 0.3, channel.shape)) * 0.001 + [-0.003, 0, 0]
    channel[1] = channel[0]
    yield "periodic", "hostile-channel", channel

    tumbling = np.stack(np.meshgrid(*[np.arange(8)] * 3), -1).reshape(-1, 3)
    tumbling = (tumbling + 0.5 + rng.uniform(-0.3, 0.3, tumbling.shape)) * 0.01 - 0.04
    yield "periodic-box", "hostile-box", tumbling

    lattice = np.stack(np.meshgrid(*[np.arange(-4, 4)] * 3), -1).reshape(-1, 3)
    yield "exact-support", "hostile-exact", lattice * 2.0**-8

    # Beside the wall of a turning cup, mostly just beyond its reach, and so thin that nothing else moves it.
    beside = np.stack(np.meshgrid(np.arange(5), np.arange(6), np.arange(6)), -1).reshape(-1, 3)
    beside = (beside + rng.uniform(-0.15, 0.15, beside.shape)) * 0.0052 + [0.0415, -0.013, -0.009]
    yield "fast-wall", "hostile-fast-wall", beside

    ball = np.stack(np.meshgrid(*[np.arange(-5, 6)] * 3), -1).reshape(-1, 3)
    ball = ball[np.sum(ball**2, axis=1) <= 25]
    yield "gathering", "hostile-gathering", (ball + rng.uniform(-0.15, 0.15, ball.shape)) * 0.004


def problems(fixtures):
    """(name, scene, time, positions, velocities) of all."""
    for name, scene, position in states(np.random.default_rng(20250726)):
        velocity = np.random.default_rng(7).uniform(-0.2, 0.2, position.shape)
        time = 0.2 if scene == "hostile-cup" else 0.0
        if name == "fast-wall":
            velocity, time = np.zeros_like(position), 0.0122
        if name == "gathering":
            velocity = -120.0 * position
        yield name, scene, time, position, velocity
    for name, time, position in astray(np.random.default_rng(19), fixtures):
        yield name, f"hostile-{name}", time, position, np.random.default_rng(7).uniform(-0.2, 0.2, position.shape)
    yield from flying(np.random.default_rng(8), fixtures)


def main():
    p = argparse.ArgumentParser(description=__doc__)
    p.add_argument("--decant", default="build/release/bin/decant", help="the command")
    p.add_argument("--fixtures", type=Path, default=Path("fixtures"))
    p.add_argument("--only", nargs="*", help="names")
    a = p.parse_args()
    for name, scene, time, position, velocity in problems(a.fixtures):
        if a.only and name not in a.only:
            continue
        with tempfile.TemporaryDirectory() as folder:
            state = Path(folder) / f"{name}.h5"
            with h5py.File(state, "w", libver="v108") as f:
                f["position"], f["velocity"] = position, velocity
                f.attrs["time"] = time
            run = subprocess.run([a.decant, "record", a.fixtures / "scenes" / f"{scene}.json", "--from", state,
                                  "--phase", f"{name}={time}", "--out", a.fixtures / f"hostile-{name}.h5", "--quiet"])
            if run.returncode:  # it has said why
                return run.returncode if run.returncode > 0 else 128 - run.returncode


if __name__ == "__main__":
    run_main(main)
