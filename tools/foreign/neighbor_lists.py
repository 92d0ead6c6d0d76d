#!/usr/bin/env python3
"""Judges neighbor-list libraries as the search inside a port: SPH in fp32 of ours, on lists of theirs.

The fixtures' oracle is the reference. What is judged is which pairs a list holds: at the cutoff, across a period."""

import subprocess
import tempfile
from pathlib import Path

import h5py
import matscipy.neighbours
import numpy as np
import vesin
from common import DECANT, Table, pairs
from numpy_port import cubic_spline, total
from scipy.spatial import cKDTree

F = np.float32
ROOT = Path(__file__).resolve().parents[2]
FIXTURES = {"pour-4k-stream": "cup pours into cup", "hostile-exact-support": "lattice with pairs at exactly H",
            "hostile-periodic": "periods in x and y", "hostile-periodic-box": "periods along every axis"}


def with_vesin(points, cutoff, side, periodic):
    found = vesin.NeighborList(cutoff=cutoff, full_list=True).compute(
        points=points, box=np.diag(side), periodic=list(periodic), quantities="ijS")
    return found[0].astype(int), found[1].astype(int), found[2]


def with_matscipy(points, cutoff, side, periodic):
    return matscipy.neighbours.neighbour_list("ijS", positions=points, cell=np.diag(side), pbc=periodic, cutoff=cutoff)


def with_ckdtree(points, cutoff, side, periodic):
    low = points.min(axis=0)
    wrapped = np.where(periodic, np.mod(points - low, side), points - low)
    i, j = cKDTree(wrapped, boxsize=np.where(periodic, side, 0)).query_pairs(cutoff, output_type="ndarray").T
    i, j = np.concatenate([i, j]), np.concatenate([j, i])
    return i, j, np.where(periodic, np.round((points[i] - points[j]) / side), 0)


def kernels(name, H):  # W, G = -W'/r, and L of the viscosity
    if name == b"cubic_spline":
        return cubic_spline(H / 2)
    if name == b"wendland_c2":
        h = float(H) / 2
        w, g, h = F(21 / (16 * np.pi * h**3)), F(105 / (16 * np.pi * h**5)), F(h)
        W, G = lambda r: w * (1 - r / H)**4 * (2 * r / h + 1), lambda r: g * (1 - r / H)**3
        return W, G, lambda r: 2 * r * r * G(r) / (r * r + F(0.01) * h * h)
    w, g = F(315 / (64 * np.pi * float(H)**9)), F(45 / (np.pi * float(H)**6))
    G = lambda r: np.where(r > 0, g * (H - r)**2 / np.where(r > 0, r, F(1)), F(0))
    return lambda r: w * (H * H - r * r)**3, G, lambda r: g * (H - r)


def solve(file, search, lose=None):
    """All fields; and how many pairs of the list are between fluid particles, at r = H, and across a period."""
    scene = {k: F(v) if isinstance(v, float) else v for k, v in file["scene"].attrs.items()}
    H, m, rho0 = (scene[k] for k in ("support_radius", "particle_mass", "rest_density"))
    W, G, L = kernels(scene["kernel"], H)
    side, periodic = file["scene/domain_max"][:] - file["scene/domain_min"][:], file["scene/periodic"][:] == 1
    x, v, gravity = (file[k][:].astype(F) for k in ("state/position", "state/velocity", "scene/gravity"))
    xw, vw, local = (file["walls/" + k][:].astype(F) for k in ("position", "velocity", "local_position"))
    n, owner, V = len(x), file["walls/container"][:], np.empty(len(xw), F)

    def listed(points):
        i, j, shift = search(points.astype(float), float(file["scene"].attrs["support_radius"]), side, periodic)
        d = points[i] - points[j] - shift.astype(F) * side.astype(F)
        return i, j, d, np.sqrt((d * d).sum(axis=1))
    for own in (owner == c for c in np.unique(owner)):
        i, _, _, r = listed(local[own])
        V[own] = 1 / (total(own.sum(), i, W(r)) + W(F(0)))
    i, j, d, r = listed(np.concatenate([x, xw]))  # one list of both
    fluid, wall = (i < n) & (j < n), (i < n) & (j >= n)
    a, b, xab, s = i[wall], j[wall] - n, d[wall], r[wall]
    keep = np.nonzero(fluid)[0][lose:]
    i, j, d, r = i[keep], j[keep], d[keep], r[keep]
    rho = total(n, i, m * W(r)) + total(n, a, rho0 * V[b] * W(s)) + m * W(F(0))

    def pressure(rho):
        p = scene["eos_stiffness"] * ((rho / rho0)**scene["eos_exponent"] - 1)
        return p if scene["allow_tension"] else np.maximum(p, F(0))

    def accelerations(rho, p):
        q, mu, mu_w = p / (rho * rho), scene["viscosity"], scene["wall_viscosity"]
        parts = {"pressure_": total(n, i, (m * (q[i] + q[j]) * G(r))[:, None] * d),
                 "viscous_": total(n, i, (mu / rho[i] * (m / rho[j]) * L(r))[:, None] * (v[j] - v[i])),
                 "wall_pressure_": total(n, a, (rho0 * V[b] * q[a] * G(s))[:, None] * xab),
                 "wall_viscous_": total(n, a, (mu_w / rho[a] * V[b] * L(s))[:, None] * (vw[b] - v[a]))}
        return {k + "acceleration": t for k, t in (parts | {"": sum(parts.values()) + gravity}).items()}
    fields = {"density": rho, "pressure": pressure(rho), "boundary_volume": V} | accelerations(rho, pressure(rho))
    for name, near, ids in (("fluid", i, j), ("wall", a, b)):
        fields |= {f"{name}_neighbor_count": np.bincount(near, minlength=n),
                   f"{name}_neighbor_id_sum": np.bincount(near, ids, n).astype(np.int64)}
    across = (abs(x[i] - x[j]) > side / 2) & periodic
    return fields, np.array([len(i), (abs(r / H - 1) < 1e-6).sum(), across.any(axis=1).sum()]) // 2


def judge(table, name, text, inputs):
    fixture = ROOT / "fixtures" / f"{name}.h5"
    subprocess.run([DECANT, "export", fixture, "--out", inputs], check=True, stdout=subprocess.DEVNULL)
    with h5py.File(inputs) as file:
        H, side = file["scene"].attrs["support_radius"], file["scene/domain_max"][:] - file["scene/domain_min"][:]
        period = np.where(file["scene/periodic"][:] == 1, side, 1e30)
        r = pairs(file["state/position"][:], H * 1.00001, period)[3]
        there = (abs(r / H - 1) < 1e-6).sum() // 2
        for library, search in (("vesin", with_vesin), ("matscipy", with_matscipy), ("scipy's cKDTree", with_ckdtree)):
            fields, (number, at_end, across) = solve(file, search)
            lost, _ = solve(file, search, lose=1)
            fault, mended = {}, {}
            if at_end:
                names = ("fluid_neighbor_count", "fluid_neighbor_id_sum")
                fault = dict.fromkeys(names, f"{at_end:,} pairs at r = H are in it; the oracle's are nearer")
                strict, _ = solve(file, lambda x, cutoff, *box: with_ckdtree(x, np.nextafter(cutoff, 0), *box))
                mended = {key: strict[key] for key in names}
            told = f"{text}: {number:,} pairs, {across:,} across a period"
            told += f", {at_end:,} of the {there:,} at r = H" if there else ""
            table.compare(f"fp32 SPH on lists of {library}", f"the oracle, {name}", told, fixture, fields, fault=fault,
                          mend="cutoff one ulp smaller", mended=mended, control={
                              key: lost[key] for key in ("density", "fluid_neighbor_count", "fluid_neighbor_id_sum")})


def main():
    table = Table("neighbor-list libraries in a port of ours", "vesin", "matscipy", "scipy", "numpy")
    with tempfile.TemporaryDirectory() as folder:
        for name, text in FIXTURES.items():
            judge(table, name, text, Path(folder) / "inputs.h5")
    table.finish()


if __name__ == "__main__":
    main()
