#!/usr/bin/env bash
# sarracen: a vertical line through a 2D fluid is 0 at every point; a 3D line without limits stays on the floor.
#
# Seen with   sarracen 1.4.1, numba 0.68.1, numpy 2.4.6, pandas 3.1.1, on the CPU; 1.2.3, 1.3.1 and 1.4.0 alike.
# Behavior    interpolate_2d_line samples a field along a line, and lineplot draws what it returns. The documentation
#             of both says that a number instead of a pair holds that coordinate fixed. For ylim it does. With xlim=0.5
#             every value is 0: the code works with the slope dy/dx, and takes 0 for it there. A line from larger to
#             smaller x is 0 too; one from larger to smaller y is right. Where x grows by 1e-7 of the length or less
#             the values are wrong, most of them not 0. Nothing is raised. With normalize=True (the default) numpy
#             warns of an invalid division, as for any empty pixel; with False nothing warns.
#             interpolate_3d_line does vertical and backward lines right. But where zlim, or its upper end, is left out
#             it ends at the smallest z, which the documentation says is the largest: the line never leaves the floor.
#             A comment in the package's own tests knows of the vertical line, and the check of it is commented out;
#             neither the documentation nor, as far as could be found, an issue tells of it or of the rest.
# Output seen still water in a tank of size 1 m, pressures in Pa, right is the direct sum with the same kernel:
#                                             first   last    right: first   last   largest error
#             xlim=0.5, y from 0 to 1            0.0     0.0        9477.9   332.1   9.5e+03
#             the same, x and y swapped       9477.9   332.1        9477.9   332.1   5.5e-12
#             x from 0.5 to 0.500001          9477.9   332.1        9477.9   332.1   5.1e-07
#             x from 0.5 to 0.5 + 1e-8        9074.1   332.1        9477.9   332.1   4.0e+02
#             3D, xlim=ylim=0.5, zlim given   9280.5   529.5        9280.5   529.5   1.0e-11
#             3D, no limits                   9335.6  9335.6        9275.2   534.8   8.8e+03
# Why         Pressure against depth is the first profile that anyone checks, and 2D runs have y upwards. Two codes'
#             profiles are then equal, 0 = 0, to every digit, whatever the fluid does; against the analytic one a right
#             port fails completely, while its horizontal profiles agree to 1e-12. Pass x="y", y="x" and ylim=0.5.
set -euo pipefail
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
# scikit-learn: sarracen imports it and does not ask for it.
"$dir/venv/bin/pip" install --quiet --no-compile --disable-pip-version-check --only-binary=:all: \
    sarracen==1.4.1 numba==0.68.1 numpy==2.4.6 pandas==3.1.1 scipy==1.17.1 scikit-learn==1.9.1
cd "$dir"
HOME="$dir" NUMBA_NUM_THREADS=1 "$dir/venv/bin/python" -W ignore - <<'PY'
import numpy as np
import sarracen
from sarracen.interpolate import interpolate_2d_line, interpolate_3d_line

samples = 40
t = (np.arange(samples) + 0.5) / samples  # a sample stands in the middle of its part of the line


def tank(dim, n):
    """A tank of size 1 of still water, n particles per side, with the pressure of the depth in the last coordinate."""
    axis = (np.arange(n) + 0.5) / n
    pos = np.stack(np.meshgrid(*[axis] * dim, indexing="ij"), axis=-1).reshape(-1, dim)
    data = {name: pos[:, k] for k, name in enumerate("xyz"[:dim])}
    data["h"], data["rho"] = np.full(len(pos), 1.2 / n), np.full(len(pos), 1000.0)
    data["m"], data["p"] = data["rho"] / n**dim, 9810 * (1 - pos[:, -1])
    sdf = sarracen.SarracenDataFrame(data)
    sdf.backend = "cpu"
    return sdf, pos


def by_hand(sdf, pos, start, end):
    """The same line by a direct sum with the cubic spline, normalized."""
    at = np.asarray(start) + t[:, None] * (np.asarray(end) - np.asarray(start))
    q = np.linalg.norm(at[:, None] - pos[None], axis=2) / sdf["h"].iloc[0]
    w = np.where(q < 1, 1 - 1.5 * q**2 + 0.75 * q**3, np.where(q < 2, 0.25 * (2 - q) ** 3, 0.0))
    return w @ sdf["p"].to_numpy() / w.sum(1)


def show(name, got, right):
    error = np.abs(got - right).max()
    print(f"{name:32} {got[0]:8.1f} {got[-1]:8.1f}   {right[0]:8.1f} {right[-1]:8.1f}   {error:.1e}")
    return error


print(f"{'':32} first, last Pa      by a direct sum     largest error")
sdf, pos = tank(2, 20)


def line2(name, start, end, **given):
    lims = {"xlim": (start[0], end[0]), "ylim": (start[1], end[1])} | given
    got = interpolate_2d_line(sdf, "p", pixels=samples, **lims)
    return got, show(name, got, by_hand(sdf, pos, start, end))


for name, start, end, given in (
    ("ylim=0.5", (0, 0.5), (1, 0.5), {"ylim": 0.5}),
    ("x from 0.2 to 0.8, y from 0 to 1", (0.2, 0), (0.8, 1), {}),
    ("x from 0.2 to 0.8, y from 1 to 0", (0.2, 1), (0.8, 0), {}),
    ("x from 0.5 to 0.500001", (0.5, 0), (0.500001, 1), {}),
    ("xlim=0.5, x and y swapped", (0.5, 0), (0.5, 1), {"x": "y", "y": "x", "xlim": (0, 1), "ylim": 0.5}),
):
    assert line2(name, start, end, **given)[1] < 1e-4
for name, start, end, given in (
    ("xlim=0.5, y from 0 to 1", (0.5, 0), (0.5, 1), {"xlim": 0.5}),
    ("xlim=0.5, not normalized", (0.5, 0), (0.5, 1), {"xlim": 0.5, "normalize": False}),
    ("x from 0.8 to 0.2, y from 1 to 0", (0.8, 1), (0.2, 0), {}),
    ("ylim=0.5, x from 1 to 0", (1, 0.5), (0, 0.5), {"ylim": 0.5}),
):
    got, error = line2(name, start, end, **given)
    assert (got == 0).all() and error > 4000
got, error = line2("x from 0.5 to 0.5 + 1e-8", (0.5, 0), (0.5 + 1e-8, 1))
assert 10 < error < 5000 and (got > 0).all()

sdf, pos = tank(3, 16)
low, high = pos.min(0), pos.max(0)
floor = [high[0], high[1], low[2]]
for name, start, end in (("3D, vertical", low[2], high[2]), ("3D, vertical, down", high[2], low[2])):
    got = interpolate_3d_line(sdf, "p", pixels=samples, xlim=0.5, ylim=0.5, zlim=(start, end))
    assert show(name, got, by_hand(sdf, pos, [0.5, 0.5, start], [0.5, 0.5, end])) < 1e-6
got = interpolate_3d_line(sdf, "p", pixels=samples, xlim=(1, 0), ylim=(1, 0), zlim=(1, 0))
assert show("3D, all backward", got, by_hand(sdf, pos, [1, 1, 1], [0, 0, 0])) < 1e-6
for name, zlim in (("3D, no limits", None), ("3D, zlim=(smallest, None)", (low[2], None))):
    got = interpolate_3d_line(sdf, "p", pixels=samples, zlim=zlim)
    assert show(name, got, by_hand(sdf, pos, low, high)) > 5000
    assert np.abs(got - by_hand(sdf, pos, low, floor)).max() < 1e-6
print("the last two are the line from the lowest corner to", *floor)
PY
