"""Facts that a reference has to obey whatever its formulas are, looked for without reference values.

An error that a port shares with its reference shows in none of their differences; these find it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from .own import Array, Inputs, Solver, evaluated


@dataclass(frozen=True)
class Property:
    """One fact and whether it holds."""

    name: str
    holds: bool
    error: float  # relative, or NaN where it is a yes or no
    said: str

    def __str__(self) -> str:
        return f"{self.name}: {'holds' if self.holds else 'violated'}, {self.said}"


def kernel_properties(
    W: Callable[[Array], Array], slope: Callable[[Array], Array] | None, support: float, dimension: int,
    tolerance: float = 1e-6,
) -> list[Property]:  # fmt: skip
    """A kernel W(r), 1/m^dimension, integrates to 1 and is 0 from the support radius on; slope(r) is its derivative."""
    nodes, weights = np.polynomial.legendre.leggauss(16)
    edges = np.linspace(0, support, 241)  # joints of usual splines are among them
    r = (edges[:-1, None] + np.diff(edges)[:, None] * (nodes + 1) / 2).ravel()
    w = (np.diff(edges)[:, None] / 2 * weights).ravel()
    shell = {1: 2 * np.ones_like(r), 2: 2 * np.pi * r, 3: 4 * np.pi * r * r}[dimension]
    integral = float((w * shell * W(r)).sum())
    peak = float(np.abs(W(np.array([0.0]))[0]))
    outside = float(np.abs(W(np.array([1.0, 1.01, 2.0]) * support)).max()) / peak
    out = [
        Property("integral", abs(integral - 1) <= tolerance, abs(integral - 1),
                 f"the integral over {dimension} dimensions is {integral:.9g}, 1 expected"),
        Property("support", outside <= tolerance, outside, f"{outside:.3g} of W(0) at the support radius and beyond"),
    ]  # fmt: skip
    if slope is not None:
        step = support * 1e-5
        inner = edges[1:-1] + 0.37 * np.diff(edges)[:-1]
        difference = (W(inner + step) - W(inner - step)) / (2 * step)
        error = float(np.abs(slope(inner) - difference).max() / np.abs(difference).max())
        ratio = float((slope(inner) * difference).sum() / (difference * difference).sum())
        said = f"the gradient is {ratio:.6g} of the kernel's derivative, largest error {error:.3g}"
        out.append(Property("derivative", error <= max(tolerance, 1e-6), error, said))
    return out


def properties(
    solver: Solver,
    inputs: Inputs,
    *,
    vectors: Iterable[str] = (),
    forces: str | None = None,
    mass: Array | float = 1.0,
    seed: int = 1,
    tolerance: float = 1e-9,
    inputs_that_turn: Iterable[str] = ("velocity",),
    period: Array | None = None,
) -> list[Property]:
    """Permutation, translation, rotation, periodic image leave a solver's answers as they are; momentum is kept.

    inputs: position [n,3] and whatever else, per particle. vectors: outputs [n,3] that rotate along. forces: an output
    [n,3], m/s^2, whose sum times mass, kg, has to vanish. period: [3], m, 0 where an axis has none; then positions are
    shifted by whole periods and nothing is rotated.
    """
    rng = np.random.default_rng(seed)
    inputs = {k: np.asarray(v, np.float64) if np.asarray(v).dtype.kind == "f" else np.asarray(v)
              for k, v in inputs.items()}  # fmt: skip
    x, vectors = inputs["position"], set(vectors)
    n, plain = len(x), evaluated(solver, inputs)
    out = []

    def compared(name: str, changed: Inputs, back: Array | None = None, rotation: Array | None = None) -> None:
        found, worst, where = evaluated(solver, changed), 0.0, "nothing changes"
        for field, values in plain.items():
            then = found[field] if back is None or len(values) != n else found[field][back]
            right = values @ rotation.T if rotation is not None and field in vectors else values
            size = np.sqrt(np.mean(values**2)) or 1.0
            error = np.abs(then - right).max() / size if np.isfinite(then).all() else np.inf
            if not error <= worst:
                worst, where = float(error), f"{field} changes by {error:.3g} of its RMS"
        out.append(Property(name, worst <= tolerance, worst, where))

    order = rng.permutation(n)
    compared("permutation", {k: v[order] if len(np.atleast_1d(v)) == n else v for k, v in inputs.items()},
             np.argsort(order))  # fmt: skip
    if period is None:
        extent = np.ptp(x, axis=0).max() or 1.0
        compared("translation", inputs | {"position": x + extent * np.array([0.25, -0.5, 1.0])})
        rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        rotation *= np.sign(np.linalg.det(rotation))
        turned = {k: inputs[k] @ rotation.T for k in ("position", *inputs_that_turn) if k in inputs}
        compared("rotation", inputs | turned, rotation=rotation)
    else:
        compared("periodic image", inputs | {"position": x + np.asarray(period) * rng.integers(-1, 2, x.shape)})
    if forces is not None:
        each = np.asarray(mass)[..., None] * plain[forces] if np.ndim(mass) else mass * plain[forces]
        share = float(np.abs(each.sum(axis=0)).max() / (np.abs(each).sum() or 1.0))
        out.append(Property("momentum", share <= tolerance, share, f"forces add up to {share:.3g} of their sizes"))
    finite = all(np.isfinite(v).all() for v in evaluated(solver, {k: v[:1] if len(np.atleast_1d(v)) == n else v
                                                                  for k, v in inputs.items()}).values())  # fmt: skip
    out.append(Property("one particle", finite, np.nan, "alone it is finite" if finite else "alone it is not finite"))
    pair = {k: v[[0, 0]] if len(np.atleast_1d(v)) == n else v for k, v in inputs.items()}
    finite = all(np.isfinite(v).all() for v in evaluated(solver, pair).values())
    out.append(Property("coincident particles", finite, np.nan, "finite" if finite else "not finite"))
    return out


def repels(solver: Solver, inputs: Inputs, forces: str) -> Property:
    """Two particles under positive pressure part: the force on the first points away from the second.

    inputs: of two particles, with the pressure or density that makes it positive. forces: an output [2,3].
    """
    found = evaluated(solver, inputs)[forces]
    x = np.asarray(inputs["position"], np.float64)
    along = float(found[0] @ (x[0] - x[1]))
    return Property("repels", along > 0, np.nan, "the pair parts" if along > 0 else "the pair attracts")
