#!/usr/bin/env python3
"""Tolerances from the formulas of oracle/tolerances.md alone, against those in a report.

    recompute_tolerances.py INPUTS.h5 REPORT.h5     what `decant export` and `decant conform --report` wrote

Every row of the report whose tolerances are kept whole is compared to 1e-6 of each tolerance. Fails where
one differs, and where fewer than the fields of both chains are there.
"""

import json
import sys

import h5py
import numpy as np

u = 2.0 ** -24 + 2.0 ** -53
N = 2.0 ** -126
SUMMED = ("pressure", "viscous", "wall_pressure", "wall_viscous")


def kernel(name, H):
    h, pi = H / 2, np.pi
    if name == "cubic_spline":
        w, g = 1 / (pi * h ** 3), 1 / (pi * h ** 5)
        W = lambda r: w * np.where(r < h, 1 - 1.5 * (r / h) ** 2 + 0.75 * (r / h) ** 3,
                                   0.25 * (2 - r / h) ** 3)
        G = lambda r: g * np.where(r < h, 3 - 2.25 * r / h,
                                   0.75 * (2 - r / h) ** 2 / np.maximum(r / h, 1))
        dG = lambda r: g / h * np.where(r < h, 2.25, 0.75 * (4 - (r / h) ** 2) / np.maximum(r / h, 1) ** 2)
    elif name == "wendland_c2":
        w, g = 21 / (16 * pi * h ** 3), 105 / (16 * pi * h ** 5)
        W = lambda r: w * (1 - r / H) ** 4 * (2 * r / h + 1)
        G = lambda r: g * (1 - r / H) ** 3
        dG = lambda r: g / h * 1.5 * (1 - r / H) ** 2
    else:
        w, g = 315 / (64 * pi * H ** 9), 45 / (pi * H ** 6)
        W = lambda r: w * (H * H - r * r) ** 3
        safe = lambda r: np.where(r > 0, r, 1)
        G = lambda r: np.where(r > 0, g * (H - r) ** 2 / safe(r), 0)
        dG = lambda r: np.where(r > 0, g * (((H - r) / safe(r)) ** 2 + 2 * (H - r) / safe(r)), 0)
        return W, G, lambda r: g * (H - r), lambda r: 6 * w * r * (H * H - r * r) ** 2, dG, \
            lambda r: g + 0 * r, g
    soft = 0.01 * h * h
    return W, G, lambda r: 2 * r * r * G(r) / (r * r + soft), lambda r: r * G(r), dG, \
        lambda r: 2 * (r * r * dG(r) * (r * r + soft) + 2 * r * G(r) * soft) / (r * r + soft) ** 2, g


def S(terms, inside):
    """Sums in any order: one sum of terms, I."""
    t = np.abs(terms)
    T = t.sum()
    if not T > 0:
        return inside
    loss = np.minimum(u * T, t)
    cells = np.floor(terms[t >= 2 * u * T] / (2 * u * T))
    E1 = loss.sum() - loss.max()
    E2 = u * T * np.sqrt((np.unique(cells, return_counts=True)[1] ** 2).sum()) + t[t < 2 * u * T].sum()
    return E1 + inside if E1 <= E2 else max(min(E1, 3 * E2), E2 + inside)


def lost(terms, factors, y, by_y):
    """F: of terms with a component y, what underflow may take. by_y: |t/y|."""
    smallest = np.minimum(np.abs(y), 1)
    for f in factors:
        smallest = smallest * np.minimum(np.abs(f) * np.ones(len(y)), 1)[:, None]
    F = np.where(smallest < 2.0 ** 20 * N, np.abs(terms), 0) + 2 * N * (1 + by_y[:, None])
    return np.where(terms != 0, F, 0)


class Pairs:
    """x_ij, r and error of pairs nearer than H, and those near H."""

    def __init__(self, x, y, domain, H, exact, same, error=None):
        low, high, period = domain
        i, j = np.indices((len(x), len(y))).reshape(2, -1)
        keep = np.abs(x[i] - y[j]).max(axis=1) < 1.1 * H if not period.any() else slice(None)
        i, j = i[keep], j[keep]
        if same:
            i, j = i[i != j], j[i != j]
        d = x[i] - y[j]
        L = np.where(period > 0, period, 1)
        d_near = np.where((period > 0) & (np.abs(d) >= period / 2), d - L * np.round(d / L), d)
        r = np.sqrt((d_near ** 2).sum(axis=1))
        keep = r < 1.05 * H
        i, j, d, x_ij, r = i[keep], j[keep], d[keep], d_near[keep], r[keep]
        turned = np.abs(d - x_ij)
        e = u * H * ((np.abs(x[i]) < H) * 1.0 + (np.abs(y[j]) < H))
        ends = 3 + (np.abs(low) + np.abs(high)) / L
        e = e + np.where(turned > 0, u * (turned * ends + np.abs(x[i]) + np.abs(x_ij)), 0)
        if error is not None:
            e = e + error[j]
        delta = 8 * u * H + np.sqrt((e ** 2).sum(axis=1))
        near = (np.abs(r - H) <= delta) & (not exact)
        self.near = i[near], j[near], x_ij[near], np.minimum(r[near], H) - delta[near]
        inside = r < H
        self.i, self.j, self.x, self.r, self.e = (a[inside] for a in (i, j, x_ij, r, e))
        self.turned = turned[inside] > 0
        size = np.sqrt((self.e ** 2).sum(axis=1))
        self.along = np.where(self.r > 0, (np.abs(self.x) * self.e).sum(axis=1) /
                              np.where(self.r > 0, self.r, 1), size)


def total(n, i, values):
    out = np.zeros((n,) + values.shape[1:])
    np.add.at(out, i, values)
    return out


def groups(n, *parts):
    """The terms of each of n sums: parts are (i, terms)."""
    i = np.concatenate([np.asarray(p[0]) for p in parts])
    t = np.concatenate([p[1] for p in parts])
    order = np.argsort(i, kind="stable")
    return np.split(t[order], np.searchsorted(i[order], np.arange(1, n)))


def cross_size(a, b):
    a, b = np.abs(a), np.abs(b)
    return np.stack([a[:, 1] * b[:, 2] + a[:, 2] * b[:, 1], a[:, 2] * b[:, 0] + a[:, 0] * b[:, 2],
                     a[:, 0] * b[:, 1] + a[:, 1] * b[:, 0]], axis=1)


def norm(a):
    return np.sqrt((a ** 2).sum(axis=1))[:, None]


class Oracle:
    def __init__(self, file):
        self.s = s = dict(file["scene"].attrs)
        self.H, self.m, self.rho0 = s["support_radius"], s["particle_mass"], s["rest_density"]
        name = s["kernel"].decode()
        self.k_W, self.k_G = (11, 8) if name == "mueller2003" else (5, 7)
        self.W, self.G, self.L, self.dW, self.dG, self.dL, self.n_G = kernel(name, self.H)
        get = lambda path: file[path][:].astype(np.float64)
        self.x, self.v, self.g = get("state/position"), get("state/velocity"), get("scene/gravity")
        low, high = get("scene/domain_min"), get("scene/domain_max")
        period = np.where(file["scene/periodic"][:] == 1, high - low, 0)
        self.local, self.xw, self.vw = (get("walls/" + k) for k in ("local_position", "position", "velocity"))
        self.owner = file["walls/container"][:]
        self.pose_errors(file, json.loads(file["scene/json"][()]))
        grid = 2.0 ** (np.floor(np.log2(self.H)) - 10)
        exact = not period.any() and not (self.x % grid).any() and self.H % grid == 0
        domain = low, high, period
        self.fluid = Pairs(self.x, self.x, domain, self.H, exact, True)
        self.wall = Pairs(self.x, self.xw, domain, self.H, False, False, self.e_b)
        self.volumes(domain)
        self.density()
        self.staged = get("staged/density"), get("staged/pressure")

    def pose_errors(self, file, scene):
        pose = {k: file["pose/" + k][:].astype(np.float64)[self.owner] for k in
                ("translation", "pivot", "angular_velocity", "linear_velocity", "surface_velocity")}
        per_wall = lambda of: np.array([of(c) for c in scene["containers"]] or [[0, 0, 0]], float)[self.owner]
        o = per_wall(lambda c: c["origin"])
        P = per_wall(lambda c: c["tilt"]["pivot"] if "tilt" in c else [0, 0, 0])
        tilts = per_wall(lambda c: 3 * ["tilt" in c]) > 0
        l, x, t, p, w = self.local, self.xw, pose["translation"], pose["pivot"], pose["angular_velocity"]
        a = l + o - P
        tilted = np.maximum(8 * norm(l) + np.abs(t) + np.abs(x),
                            9 * norm(a) + norm(l + o) + norm(P) + np.abs(p) + np.abs(x))
        self.e_b = u * np.where(tilts, tilted, np.abs(t) + np.abs(x))
        lever = x - p
        self.dv_b = 4 * u * cross_size(w, lever) + cross_size(w, self.e_b + u * np.abs(p)) + \
            u * np.abs(self.vw) + 2 * u * (np.abs(pose["linear_velocity"]) + np.abs(pose["surface_velocity"]))

    def volumes(self, domain):
        M = len(self.local)
        self.V, self.tau_V = np.zeros(M), np.zeros(M)
        for c in np.unique(self.owner):
            own = np.flatnonzero(self.owner == c)
            p = Pairs(self.local[own], self.local[own], domain, self.H, True, True)
            n, W0 = len(own), self.W(np.zeros(1))
            W, dW = self.W(p.r), self.dW(p.r)
            I = u * ((7 + self.k_W) * (W0 + total(n, p.i, W)) + 6.5 * total(n, p.i, p.r * dW) +
                     np.abs(total(n, p.i, p.r * dW - 3 * W) - 3 * W0)) + total(n, p.i, dW * p.along)
            self.V[own] = 1 / (W0 + total(n, p.i, W))
            terms = groups(n, (np.arange(n), np.repeat(W0, n)), (p.i, W))
            self.tau_V[own] = [V * V * S(t, i) + 2 * u * V for V, t, i in zip(self.V[own], terms, I)]

    def density(self):
        n, f, w = len(self.x), self.fluid, self.wall
        t0 = self.m * self.W(np.zeros(1))
        tf, tw = self.m * self.W(f.r), self.rho0 * self.V[w.j] * self.W(w.r)
        sf, sw = self.m * self.dW(f.r), self.rho0 * self.V[w.j] * self.dW(w.r)
        self.rho = t0 + total(n, f.i, tf) + total(n, w.i, tw)
        by_H = total(n, f.i, f.r * sf - 3 * tf) + total(n, w.i, w.r * sw - 3 * tw) - 3 * t0
        I = u * ((12 + self.k_W) * (t0 + total(n, f.i, tf)) + (10 + self.k_W) * total(n, w.i, tw) +
                 6.5 * (total(n, f.i, f.r * sf) + total(n, w.i, w.r * sw)) + np.abs(by_H))
        rest = total(n, f.i, sf * f.along) + total(n, w.i, sw * w.along) + \
            total(n, w.i, self.rho0 * self.tau_V[w.j] * self.W(w.r))
        i, _, _, r = f.near
        rest += total(n, i, self.m * self.W(r))
        i, b, _, r = w.near
        rest += total(n, i, self.rho0 * self.V[b] * self.W(r))
        terms = groups(n, (np.arange(n), np.repeat(t0, n)), (f.i, tf), (w.i, tw))
        self.tau_rho = np.array([S(t, k) for t, k in zip(terms, I)]) + rest

    def pressure(self, rho, tau_rho):
        gamma, B, c0 = (self.s[k] for k in ("eos_exponent", "eos_stiffness", "sound_speed"))
        x = rho / self.rho0
        g = 2 if np.float32(self.rho0) == self.rho0 else 3
        P = B * (x ** gamma - 1)
        tau = c0 ** 2 * x ** (gamma - 1) * tau_rho + u * ((g * gamma + 6) * B * x ** gamma + 6 * np.abs(P))
        if self.s["allow_tension"]:
            return P, tau
        return np.maximum(P, 0), np.where(P + tau < 0, 0, tau)

    def in_common(self, rho, p, tau_p):
        w, n, gamma = self.wall, len(rho), self.s["eos_exponent"]
        slope = self.s["sound_speed"] ** 2 * (rho / self.rho0) ** (gamma - 1) / rho ** 2 - 2 * p / rho ** 3
        steep = np.where(w.r > 0, self.rho0 * self.V[w.j] * self.dW(w.r) / np.where(w.r > 0, w.r, 1), 0)
        volumes = total(n, w.i, self.rho0 * self.tau_V[w.j] * self.W(w.r))
        shifts = [u * (self.k_W + 4) * rho, *total(n, w.i, steep[:, None] * w.x * w.e).T, volumes]
        f = self.fluid
        steep_f = np.where(f.r > 0, self.m * self.dW(f.r) / np.where(f.r > 0, f.r, 1), 0)
        for side in (1, -1):
            shifts += [*sum(total(n, p.i, s[:, None] * np.where(p.turned & (side * p.x > 0), np.abs(p.x) * p.e, 0))
                            for p, s in ((f, steep_f), (w, steep))).T]
        return [np.where(tau_p == 0, 0, s * slope) for s in shifts]

    def accelerations(self, rho, p, tau_rho, tau_p, in_common=()):
        n, f, w, m, rho0, V = len(self.x), self.fluid, self.wall, self.m, self.rho0, self.V
        mu, mu_w = self.s["viscosity"], self.s["wall_viscosity"]
        q = p / rho ** 2
        tau_q = tau_p / rho ** 2 + 2 * np.abs(p) * tau_rho / rho ** 3 + 4 * u * np.abs(p) / rho ** 2
        col = lambda a: np.asarray(a)[:, None]
        G, dG, L, dL = self.G(f.r), self.dG(f.r), self.L(f.r), self.dL(f.r)
        Gw, dGw, Lw, dLw = self.G(w.r), self.dG(w.r), self.L(w.r), self.dL(w.r)
        x, xw = np.abs(f.x), np.abs(w.x)
        t, I, rest, grad, sq = {}, {}, {}, {}, {}

        def part(name, pairs, terms, inside, pose, inputs, common, factors, by_y, y):
            t[name] = pairs.i, terms
            I[name] = u * total(n, pairs.i, inside) + common * u * np.abs(total(n, pairs.i, terms))
            K = self.n_G * np.ones(len(pairs.i))
            F = lost(terms, [*factors[:-1], K, factors[-1] / K], y, by_y)
            rest[name] = total(n, pairs.i, pose + inputs + F)
            grad[name] = sq[name] = np.zeros((n, 3))
        A = m * (np.abs(q[f.i]) + np.abs(q[f.j]))
        part("pressure", f, col(m * (q[f.i] + q[f.j]) * G) * f.x, col(A * (12 * G + 7.5 * f.r * dG)) * x,
             col(A * G) * f.e + col(A * dG * f.along) * x, 0 * x, self.k_G + 9,
             [m, np.abs(q[f.i]) + np.abs(q[f.j]), G], A * G, f.x)
        grad["pressure"] = total(n, f.i, col(m * G) * f.x)
        sq["pressure"] = total(n, f.i, (col(m * tau_q[f.j] * G) * x) ** 2)
        for s in in_common:
            rest["pressure"] += np.abs(total(n, f.i, col(m * (s[f.i] + s[f.j]) * G) * f.x))
        i, j, xn, r = f.near
        rest["pressure"] += total(n, i, col(m * np.abs(q[i] + q[j]) * self.G(r)) * np.abs(xn))
        dv, A = self.v[f.j] - self.v[f.i], mu / rho[f.i] * m / rho[f.j]
        rel = tau_rho / rho
        part("viscous", f, col(A * L) * dv, col(A * (16 * L + 7.5 * f.r * dL)) * np.abs(dv),
             col(A * dL * f.along) * np.abs(dv), col((rel[f.i] + rel[f.j]) * A * L) * np.abs(dv),
             self.k_G + 9, [mu, m, 1 / rho[f.i], 1 / rho[f.j], L], A * L, dv)
        rest["viscous"] += total(n, i, col(mu / rho[i] * m / rho[j] * self.L(r)) *
                                 np.abs(self.v[j] - self.v[i]))
        A = rho0 * V[w.j] * np.abs(q[w.i])
        part("wall_pressure", w, col(rho0 * V[w.j] * q[w.i] * Gw) * w.x,
             col(A * (14 * Gw + 7.5 * w.r * dGw)) * xw, col(A * Gw) * w.e + col(A * dGw * w.along) * xw,
             col(A * self.tau_V[w.j] / V[w.j] * Gw) * xw, self.k_G + 5, [rho0, V[w.j], q[w.i], Gw], A * Gw, w.x)
        grad["wall_pressure"] = total(n, w.i, col(rho0 * V[w.j] * Gw) * w.x)
        i, b, xn, r = w.near
        rest["wall_pressure"] += total(n, i, col(rho0 * V[b] * np.abs(q[i]) * self.G(r)) * np.abs(xn))
        dv, A = self.vw[w.j] - self.v[w.i], mu_w * V[w.j] / rho[w.i]
        part("wall_viscous", w, col(A * Lw) * dv, col(A * (18 * Lw + 7.5 * w.r * dLw)) * np.abs(dv),
             col(A * dLw * w.along) * np.abs(dv) + col(A * Lw) * self.dv_b[w.j],
             col((rel[w.i] + self.tau_V[w.j] / V[w.j]) * A * Lw) * np.abs(dv), self.k_G + 5,
             [mu_w, 1 / rho[w.i], V[w.j], Lw], A * Lw, dv)
        rest["wall_viscous"] += total(n, i, col(mu_w * V[b] / rho[i] * self.L(r)) *
                                      np.abs(self.vw[b] - self.v[i]))

        def tolerance(names, extra_terms, extra_inside):
            out = np.zeros((n, 3))
            inside = sum(I[k] for k in names) + extra_inside
            for c in range(3):
                terms = groups(n, *[(t[k][0], t[k][1][:, c]) for k in names],
                               (np.arange(n), np.repeat(extra_terms[c], n)))
                out[:, c] = [S(a, b) for a, b in zip(terms, inside[:, c])]
            return out + sum(rest[k] for k in names) + np.sqrt(sum(sq[k] for k in names)) + \
                2 * tau_q[:, None] * np.abs(sum(grad[k] for k in names))
        nothing = np.zeros(3)
        taus = {k + "_acceleration": tolerance([k], nothing, 0) for k in SUMMED}
        return taus | {"acceleration": tolerance(SUMMED, self.g, u * np.abs(self.g))}

    def tolerances(self):
        out = {("boundary_volume", "boundary_volume"): self.tau_V, ("density", "density"): self.tau_rho}
        p, tau_p = self.pressure(self.rho, self.tau_rho)
        out["pressure", "pressure"] = tau_p
        for name, tau in self.accelerations(self.rho, p, self.tau_rho, tau_p,
                                             self.in_common(self.rho, p, tau_p)).items():
            out["evaluation", name] = tau
        rho, p = self.staged
        out["equation_of_state", "pressure"] = self.pressure(rho, 0 * rho)[1]
        for name, tau in self.accelerations(rho, p, 0 * rho, 0 * p).items():
            out["acceleration", name] = tau
        return out


def main(inputs, report):
    with h5py.File(inputs, "r") as file:
        expected = Oracle(file).tolerances()
    wrong = 0
    with h5py.File(report, "r") as file:
        for row in file["checks"].values():
            key = row.attrs["check"].decode(), row.attrs["field"].decode()
            if row.attrs["kept"] != b"whole" or key not in expected:
                continue
            found, tau = row["tolerance"][:].astype(np.float64), expected.pop(key).reshape(-1)
            off = np.abs(found - tau) > 1e-6 * tau
            worst = (np.abs(found - tau) / np.where(tau > 0, tau, 1)).max() if len(tau) else 0
            print(f"{key[0]} / {key[1]}: {len(tau)} tolerances, largest difference {worst:.1e}")
            if off.any():
                at = np.flatnonzero(off)[0]
                print(f"    {off.sum()} differ, {at}: {found[at]:.9g} in the report, {tau[at]:.9g}")
            wrong += int(off.sum())
    missing = [key for key, tau in expected.items() if tau.size]
    for key in missing:
        print(f"{key[0]} / {key[1]}: not in the report")
    return 1 if wrong or missing else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
