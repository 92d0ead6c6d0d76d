#!/usr/bin/env python3
"""An SPH port that is not ours, as an example: numpy, float32, all pairs, one state.

decant export FIXTURE.h5 --out inputs.h5; numpy_port.py inputs.h5 --out theirs.h5 [--fault NAME];
decant conform FIXTURE.h5 --results theirs.h5"""

import argparse

import numpy as np

from one_line import open_hdf5, run_main
from results_file import write_results

F = np.float32
FAULTS = ("none", "viscosity", "neighbor", "volume", "self", "wall-at-rest", "nan")


def pairs(a, b, radius, self_too=False):  # nearer than the radius: i, j, x_ij and r
    found = []
    for start in range(0, len(a), 256):
        square = sum((a[start:start + 256, None, k] - b[None, :, k]) ** 2 for k in range(3))
        found.append(np.nonzero(square < radius * radius) + np.array([[start], [0]]))
    i, j = np.hstack(found)
    keep = slice(None) if self_too or a is not b else i != j
    i, j, x = i[keep], j[keep], (a[i] - b[j])[keep]
    return i, j, x, np.sqrt((x * x).sum(axis=1))


def total(n, i, terms):  # of each i
    out = np.zeros((n,) + terms.shape[1:], F)
    np.add.at(out, i, terms)
    return out


def cubic_spline(h):  # W, G = -W'/r, and L of the viscosity
    w, g = F(1 / (np.pi * float(h) ** 3)), F(1 / (np.pi * float(h) ** 5))

    def W(r):
        q = r / h
        return w * np.where(q < 1, 1 - F(1.5) * q * q + F(0.75) * q ** 3, F(0.25) * (2 - q) ** 3)

    def G(r):
        q = r / h
        return g * np.where(q < 1, 3 - F(2.25) * q, F(0.75) * (2 - q) ** 2 / np.maximum(q, F(1)))
    return W, G, lambda r: 2 * r * r * G(r) / (r * r + F(0.01) * h * h)


def solve(file, fault):
    scene = {k: F(v) if isinstance(v, float) else v for k, v in file["scene"].attrs.items()}
    if scene["kernel"] != b"cubic_spline" or file["scene/periodic"][:].any():
        raise SystemExit("numpy_port: cubic spline and free axes only")
    H, m, rho0 = (scene[k] for k in ("support_radius", "particle_mass", "rest_density"))
    W, G, L = cubic_spline(H / 2)
    x, v, g = (file[k][:].astype(F) for k in ("state/position", "state/velocity", "scene/gravity"))
    xw, vw, local = (file["walls/" + k][:].astype(F)
                     for k in ("position", "velocity", "local_position"))
    vw *= F(fault != "wall-at-rest")
    mu, mu_w = scene["viscosity"] * F(1.01 if fault == "viscosity" else 1), scene["wall_viscosity"]
    n, V, owner = len(x), np.empty(len(xw), F), file["walls/container"][:]
    for own in (owner == c for c in np.unique(owner)):  # in its own frame, where it never changes
        i, _, _, r = pairs(local[own], local[own], H, self_too=True)
        V[own] = 1 / total(own.sum(), i, W(r))
    V[:] = scene["particle_spacing"] ** 3 if fault == "volume" else V
    i, j, xij, r = pairs(x, x, H)
    if fault == "neighbor":  # the first particle does not see the nearest of its neighbors
        seen = np.arange(len(i)) != np.argmin(np.where(i == i[0], r, H))
        i, j, xij, r = i[seen], j[seen], xij[seen], r[seen]
    a, b, xab, s = pairs(x, xw, H)
    rho = total(n, i, m * W(r)) + total(n, a, rho0 * V[b] * W(s)) + F(fault != "self") * m * W(F(0))

    def pressure(rho):
        p = scene["eos_stiffness"] * ((rho / rho0) ** scene["eos_exponent"] - 1)
        return p if scene["allow_tension"] else np.maximum(p, F(0))
    p = pressure(rho)
    fields = {"boundary_volume": V, "density": rho, "pressure": p}
    for name, near, ids in (("fluid", i, j), ("wall", a, b)):
        fields[f"{name}_neighbor_count"] = np.bincount(near, minlength=n)
        fields[f"{name}_neighbor_id_sum"] = np.bincount(near, ids, n).astype(np.int64)

    def accelerations(rho, p):
        q = p / (rho * rho)
        parts = {
            "pressure_": total(n, i, (m * (q[i] + q[j]) * G(r))[:, None] * xij),
            "viscous_": total(n, i, (mu / rho[i] * (m / rho[j]) * L(r))[:, None] * (v[j] - v[i])),
            "wall_pressure_": total(n, a, (rho0 * V[b] * q[a] * G(s))[:, None] * xab),
            "wall_viscous_": total(n, a, (mu_w / rho[a] * V[b] * L(s))[:, None] * (vw[b] - v[a]))}
        parts |= {"": sum(parts.values()) + g}
        return {k + "acceleration": t for k, t in parts.items()}
    fields |= accelerations(rho, p)
    rho[n // 2] = np.nan if fault == "nan" else rho[n // 2]
    staged = file["staged/density"][:]
    return fields, accelerations(staged, file["staged/pressure"][:]) | {"pressure": pressure(staged)}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("inputs")
    parser.add_argument("--out", required=True)
    parser.add_argument("--fault", choices=FAULTS, default=FAULTS[0])
    arguments = parser.parse_args()
    with open_hdf5(arguments.inputs, ["decant_inputs"], "what `decant export` writes") as opened:
        write_results(arguments.out, *solve(opened, arguments.fault), device="numpy",
                      fixture_sha256=opened.attrs["fixture_sha256"].decode())


if __name__ == "__main__":
    run_main(main)
