"""Kernels, sums and pairs in NumPy, fp32."""

import numpy as np

F = np.float32


def kernels(family, H):
    """W, G and L of r, m (reference/README.md, "Kernels")."""
    h, c = F(H / 2), 1 / (np.pi * (H / 2) ** 3)
    w, g = F(c), F(4 * c / H**2)
    u = lambda r: np.maximum(2 - r / h, F(0))
    if family == "mueller2003":
        W = lambda r: F(315 / 512) * w * np.maximum(1 - (r / h) ** 2 / 4, F(0)) ** 3
        G = lambda r: np.where(r > 0, F(45 / 64) * g * u(r) ** 2 * h / np.where(r > 0, r, F(1)), F(0))
        return W, G, lambda r: F(45 / 64) * g * u(r)
    if family == "wendland_c2":
        W = lambda r: F(21 / 256) * w * u(r) ** 4 * (2 * r / h + 1)
        G = lambda r: F(105 / 128) * g * u(r) ** 3
    else:
        W = lambda r: w * np.where(r < h, 1 - (r / h) ** 2 * (F(1.5) - F(0.75) * r / h), F(0.25) * u(r) ** 3)
        G = lambda r: g * np.where(r < h, 3 - F(2.25) * r / h, F(0.75) * u(r) ** 2 / np.maximum(r / h, F(1)))
    return W, G, lambda r: 2 * r * r * G(r) / (r * r + F(0.01) * h * h)


def total(i, terms, n):
    """Sums of terms [k] or [k,3] per particle i [k]: [n] or [n,3]."""
    sums = [np.bincount(i, component, n) for component in np.atleast_2d(terms.T)]
    return np.stack(sums, axis=-1).reshape((n, *terms.shape[1:])).astype(F)


def pairs(scene, a, b, periodic):
    """Pairs of a and b within H: indices i and j, x_i - x_j by the nearest image, and r."""
    H = F(scene.support_radius)
    if not len(a) or not len(b):
        return np.zeros(0, int), np.zeros(0, int), np.zeros((0, 3), F), np.zeros(0, F)
    period = np.where(periodic, np.subtract(scene.domain_max, scene.domain_min), 1e9)  # m
    both = np.where(np.isfinite(points := np.concatenate([a, b]).astype(float)), points, 0)
    low = np.where(periodic, scene.domain_min, both.min(0))
    # A period may be 3 H to the last bit, and two cells would show each neighbor twice.
    count = np.where(periodic, np.floor(period / scene.support_radius + 1e-6), 1 << 20).astype(int)
    edge = np.where(periodic, period / count, scene.support_radius)
    cell = np.floor((both - low) / edge).astype(int) % count
    number = lambda c: (c[:, 0] << 42) + (c[:, 1] << 21) + c[:, 2]
    order = np.argsort(number(cell[len(a):]), kind="stable")
    numbers = number(cell[len(a):])[order]
    found = []
    for offset in np.ndindex(3, 3, 3):
        near = number((cell[:len(a)] + np.array(offset) - 1) % count)
        first, last = np.searchsorted(numbers, near, "left"), np.searchsorted(numbers, near, "right")
        i = np.repeat(np.arange(len(a)), last - first)
        j = order[np.arange(len(i)) + np.repeat(last - np.cumsum(last - first), last - first)]
        d = a[i] - b[j]
        d -= (period * np.round(d / period) * (np.abs(d) >= period / 2)).astype(F)
        square = (d * d).sum(1)
        keep = square < H * H
        found.append((i[keep], j[keep], d[keep], np.sqrt(square[keep])))
    return tuple(np.concatenate(part) for part in zip(*found))
