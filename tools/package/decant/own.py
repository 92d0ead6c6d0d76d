"""Solvers with formulas of their own: bounds measured from their reference, verdicts, and what is wrong in words.

A solver here is a function from named arrays to named arrays, {"position": [n,3], …} -> {"density": [n], …}; row i is
particle i. The reference computes in double; the port is what is judged.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from .arrays import on_host
from .results_file import field

Array = np.ndarray
Inputs = Mapping[str, Array]
Solver = Callable[[dict[str, Array]], Mapping[str, Any]]

UNIT_ROUNDOFF = 2.0**-24  # of fp32
# Spreads that a value may be off by: rounding inside the formulas adds to that of the inputs. Of 159,000 values each of
# two correct ports, one that sums in double and one in fp32, none is off by more (fixtures/results/host/spread.txt).
FACTOR = 64.0
FLOOR = 64.0  # roundings of the value, and of the field's RMS, where inputs are exact


@dataclass(frozen=True)
class Bound:
    """What a field of a port in fp32 may be."""

    value: Array  # of the reference
    spread: Array  # largest |change| of a value over the copies
    tolerance: Array  # FACTOR * spread + FLOOR u (|value| + RMS)
    false_alarms: float  # share of a correct port's values that fail, upper 95 % limit; NaN: no fp32 program was given
    copies: int

    def field(self, unit: str | None = None) -> dict[str, Any]:
        """For write_reference(): the value with its tolerance, to judge a port that is another program."""
        return field(self.value, unit, each=self.tolerance)


def evaluated(solver: Solver, inputs: Inputs) -> dict[str, Array]:
    """Outputs on the host, in double."""
    return {name: np.asarray(on_host(values), np.float64) for name, values in solver(dict(inputs)).items()}


def _moved(inputs: Inputs, rng: np.random.Generator, order: Array, kept: tuple[str, ...]) -> dict[str, Array]:
    """Real inputs moved by half an ulp of fp32 at most, all of them permuted."""
    out = {}
    for name, values in inputs.items():
        values = np.asarray(values)
        if values.dtype.kind == "f" and name not in kept:
            ulp = np.spacing(np.abs(values).astype(np.float32)).astype(np.float64)
            values = values + 0.5 * ulp * rng.uniform(-1, 1, values.shape)
        out[name] = values[order] if values.ndim and len(values) == len(order) else values
    return out


def _tail_share(scores: Array, limit: float) -> float:
    """Share of scores beyond a limit, upper 95 % limit: counted, or by the exponential tail of the top hundredth."""
    scores = scores[np.isfinite(scores)]
    counted = int((scores > limit).sum())
    if counted > 10 or len(scores) < 1000:
        return (counted + 3.0) / max(len(scores), 1)
    start = np.quantile(scores, 0.99)
    excess = scores[scores > start] - start
    scale = excess.mean() * (1 + 2 / np.sqrt(len(excess))) if len(excess) else 0.0
    return float(0.01 * np.exp(-(limit - start) / scale)) if scale > 0 else 0.0


def spread(
    reference: Solver,
    inputs: Inputs,
    *,
    copies: int = 16,
    seed: int = 1,
    exact: tuple[str, ...] = (),
    single: Solver | None = None,
) -> dict[str, Bound]:
    """Measures how far correct values of a port in fp32 may be off, without an analysis of the formulas.

    The reference is evaluated on copies of the inputs (fp32 values) whose real numbers are moved by at most half an
    ulp and whose particles are permuted; how far each value moves is its spread. exact: inputs that are not moved.
    single: the same program in fp32; from its scores on the copies the share of false alarms is estimated.

    Not seen: an error that both programs share (properties() looks for those), and one below 64 spreads. An input that
    decides something (a pair at the cutoff) makes the spread as large as what it decides.
    """
    rng = np.random.default_rng(seed)
    n = max(len(np.atleast_1d(v)) for v in inputs.values())
    value = evaluated(reference, {k: np.asarray(v, np.float64) if np.asarray(v).dtype.kind == "f" else v
                                   for k, v in inputs.items()})  # fmt: skip
    for name, values in value.items():
        if not np.isfinite(values).all():
            raise ValueError(f"the reference's {name} is not finite at {int(np.argmin(np.isfinite(values).ravel()))}")
    widest = {name: np.zeros_like(values) for name, values in value.items()}
    scores: dict[str, list[Array]] = {name: [] for name in value}
    errors: dict[str, list[Array]] = {name: [] for name in value}
    for _ in range(copies):
        order = rng.permutation(n)
        back = np.argsort(order)
        moved = _moved(inputs, rng, order, exact)
        found = evaluated(reference, moved)
        if single is not None:
            # What fp32 makes of the copy, beside double on what fp32 reads.
            read = {k: v.astype(np.float32) if v.dtype.kind == "f" else v for k, v in moved.items()}
            right = evaluated(reference, {k: v.astype(np.float64) if v.dtype.kind == "f" else v
                                           for k, v in read.items()})  # fmt: skip
            theirs = evaluated(single, read)
        for name, values in value.items():
            rows = back if len(values) == n else slice(None)
            widest[name] = np.maximum(widest[name], np.abs(found[name][rows] - values))
            if single is not None:
                errors[name].append(np.abs(theirs[name] - right[name])[rows])
    out = {}
    for name, values in value.items():
        floor = FLOOR * UNIT_ROUNDOFF * (np.abs(values) + np.sqrt(np.mean(values**2)))
        tolerance = FACTOR * widest[name] + floor
        share = np.nan
        if single is not None:
            scores[name] = [_scores(error, tolerance) for error in errors[name]]
            share = _tail_share(np.concatenate([s.ravel() for s in scores[name]]), 1.0)
        out[name] = Bound(values, widest[name], tolerance, share, copies)
    return out


def _scores(error: Array, tolerance: Array) -> Array:
    with np.errstate(divide="ignore", invalid="ignore"):
        score = error / tolerance
    return np.where(error == 0, 0.0, np.where(np.isfinite(score), score, np.inf))


@dataclass(frozen=True)
class OwnVerdict:
    """What became of one field of a port."""

    field: str
    passes: bool
    score: float  # largest |error| / tolerance
    particle: int  # of it
    beyond: int  # values that fail
    diagnosis: str  # of the kind of the error, in words; "" where it passes

    def __str__(self) -> str:
        if self.passes:
            return f"{self.field}: pass, score {self.score:.3g}"
        return f"{self.field}: fail, score {self.score:.3g} at particle {self.particle}; {self.diagnosis}"


def judge(port: Solver, bounds: Mapping[str, Bound], inputs: Inputs) -> list[OwnVerdict]:
    """Compares a port with bounds of spread(), field by field; NaN fails. ValueError where a field is missing."""
    found = evaluated(port, {k: np.asarray(v, np.float32) if np.asarray(v).dtype.kind == "f" else v
                              for k, v in inputs.items()})  # fmt: skip
    out = []
    for name, bound in bounds.items():
        if name not in found or found[name].shape != bound.value.shape:
            raise ValueError(f"the port's {name} is missing, or not of shape {list(bound.value.shape)}")
        actual = found[name]
        score = _scores(np.abs(actual - bound.value), bound.tolerance)
        worst = int(np.argmax(score))
        beyond = int((score > 1).sum())
        position = inputs.get("position")
        row = worst // (score.size // len(score)) if len(score) else -1
        largest = float(score.ravel()[worst]) if score.size else 0.0
        said = diagnose(actual, bound.value, bound.tolerance, position) if beyond else ""
        out.append(OwnVerdict(name, beyond == 0, largest, row, beyond, said))
    return out


def cut_out(inputs: Inputs, particle: int, radius: float, period: Array | None = None) -> dict[str, Array]:
    """The inputs of the particles within `radius`, m, of one, which comes first: a small problem to debug with.

    period: [D], m, 0 where an axis has none. Inputs that are not per particle stay as they are.
    """
    x = np.asarray(inputs["position"], np.float64)
    apart = x - x[particle]
    if period is not None:
        some = np.where(np.asarray(period) > 0, period, 1)
        apart -= np.where(np.asarray(period) > 0, some * np.round(apart / some), 0)
    distance = np.sqrt((apart**2).sum(axis=1))
    near = np.flatnonzero(distance <= radius)
    near = near[np.argsort(distance[near], kind="stable")]
    near = np.concatenate([[particle], near[near != particle]])
    return {name: np.asarray(v)[near] if len(np.atleast_1d(v)) == len(x) else v for name, v in inputs.items()}


def diagnose(actual: Array, expected: Array, tolerance: Array, position: Array | None = None) -> str:
    """The kind of an error, in words: not finite, opposite sign, a factor, an offset, one component, or a region.

    actual, expected, tolerance: [n], or [n,…] of vectors and tensors; position: [n,D], in which a region is looked for.
    """
    actual, expected, tolerance = (np.asarray(v, np.float64) for v in (actual, expected, tolerance))
    bad = ~(np.abs(actual - expected) <= tolerance)
    if not bad.any():
        return "nothing is wrong"
    finite = np.isfinite(actual)
    rows = bad.reshape(len(bad), -1).any(axis=1)
    if not finite.all():
        lost = ~finite.reshape(len(bad), -1).all(axis=1)
        return f"{int(lost.sum())} of {len(lost)} particles are not finite, the first is {int(np.argmax(lost))}"

    def explains(values: Array) -> bool:
        right = np.abs(actual - values) <= 3 * tolerance
        return bool(right.mean() > 0.99 and right[bad].mean() > 0.99)

    if explains(-expected):
        return "opposite sign"
    norm = float((expected * expected).sum())
    factor = float((actual * expected).sum()) / norm if norm > 0 else 1.0
    if explains(factor * expected):
        return f"all values × {factor:.6g}"
    offset = (actual - expected).mean(axis=0)
    if explains(expected + offset):
        return "all values + " + np.array2string(np.asarray(offset), precision=4)
    said = f"{int(rows.sum())} of {len(rows)} particles are wrong"
    components = bad.any(axis=0) if bad.ndim > 1 else np.zeros(0, bool)
    if components.sum() == 1:
        which = [int(k) for k in np.unravel_index(int(np.argmax(components)), components.shape)]
        name = "xyz"[which[0]] if len(which) == 1 and which[0] < 3 else which
        said += f", in component {name} alone"
    if position is not None and 3 < rows.sum() < 0.5 * len(rows):
        for axis, x in enumerate(np.asarray(position).T):
            # A region is where most particles are on the other side of all of them.
            if x[rows].min() > np.quantile(x, 0.5):
                said += f", all beyond {'xyz'[axis]} = {x[rows].min():.6g}"
            elif x[rows].max() < np.quantile(x, 0.5):
                said += f", all below {'xyz'[axis]} = {x[rows].max():.6g}"
    larger = float((np.abs(actual[bad]) > np.abs(expected[bad])).mean())
    if larger > 0.95 or larger < 0.05:
        said += f", {'too large' if larger > 0.5 else 'too small'}"
    return said
