"""What the drivers of this folder share: pairs, kernels, the call of `decant conform`, and rows of the table."""

import argparse
import importlib.metadata
import json
import os
import platform
import subprocess
import sys
import tempfile
from pathlib import Path

import h5py
import numpy as np
from numpy.polynomial import Polynomial

from results_file import write_reference, write_results

CONTROL = 1e-4  # relative error that has to fail
DECANT = os.environ.get("DECANT", "decant")
COLUMNS = ("score", "score_p50", "actual", "expected")


def pairs(x, cutoff, period=None, self_too=False):
    """Ordered pairs nearer than the cutoff, all against all: i, j, x_i - x_j by the nearest image, r. In double."""
    x, found = np.asarray(x, np.float64), []
    for start in range(0, len(x), 256):
        d = x[start:start + 256, None] - x[None]
        if period is not None:
            d -= period * np.round(d / period)
        i, j = np.nonzero((d * d).sum(axis=2) < cutoff * cutoff)
        keep = np.full(len(i), True) if self_too else i + start != j
        found.append((i[keep] + start, j[keep], d[i[keep], j[keep]]))
    i, j, d = (np.concatenate(part) for part in zip(*found))
    return i, j, d, np.sqrt((d * d).sum(axis=1))


def total(n, i, terms):
    out = np.zeros((n,) + np.shape(terms)[1:])
    np.add.at(out, i, terms)
    return out


def off(values):
    """Values that have to fail: real ones off by CONTROL, whole ones by 1 at one particle."""
    return values * np.float64(1 + CONTROL) if values.dtype.kind == "f" else values + (np.arange(len(values)) == 0)


def block(rng, side, spacing, jitter=0.2):
    """side^3 jittered lattice points, in fp32."""
    lattice = np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij"), -1).reshape(-1, 3) + 0.5
    return ((lattice + jitter * rng.uniform(-1, 1, lattice.shape)) * spacing).astype(np.float32)


class Kernel:
    """A radial kernel: a sum of (1 - q/a)^n P(q), q = r/h, each zero beyond q = a, its constant by quadrature.

    parts: (a, n, coefficients of P from the constant term up) of each."""

    def __init__(self, parts, h, dim):
        self.h, self.parts = h, parts
        self.cutoff = h * max(a for a, _, _ in self.parts)
        nodes, weights = np.polynomial.legendre.leggauss(20)
        integral = 0
        for start in range(6):  # the joints are at multiples of 1/2
            q = (start + (nodes + 1) / 2) / 2
            integral += (weights / 4 * self.shape(q)[0] * (2, 2 * np.pi * q, 4 * np.pi * q * q)[dim - 1]).sum()
        self.norm = 1 / (integral * h**dim)

    def shape(self, q):
        """Value, and the size of what it is summed from, with the condition of 1 - q/a; the same of the derivative."""
        out = np.zeros((4,) + np.shape(q))
        for a, n, coefficients in self.parts:
            P, t = Polynomial(coefficients), np.maximum(1 - q / a, 0)
            p, dp = P(q), P.deriv()(q)
            terms = t**n * p, -n / a * t**(n - 1) * p, t**n * dp
            second = n * (n - 1) / a * t**(n - 2) * p
            out += (terms[0], abs(terms[0]) + a * abs(terms[1]), terms[1] + terms[2],
                    abs(terms[1]) + abs(second) + abs(terms[2]) + n * t**(n - 1) * abs(dp))
        return out

    def __call__(self, r):
        """W, its size, W', its size."""
        value, size, slope, steep = self.norm * self.shape(r / self.h)
        return value, size, slope / self.h, steep / self.h


class Table:
    """Rows of one code. A run fails where a verdict is not the one that the driver states."""

    def __init__(self, code, *packages):
        parser = argparse.ArgumentParser(description=f"Judges {code}; called by tools/foreign/judge.sh")
        parser.add_argument("--out", type=Path, required=True, help="JSON file of the rows")
        self.out = parser.parse_args().out
        self.about = {"code": code, "command": f"tools/foreign/judge.sh {self.out.stem}",
                      "versions": {p: importlib.metadata.version(p) for p in packages},
                      "python": platform.python_version(), "machine": platform.machine()}
        self.rows, self.wrong = [], []

    def judge(self, reference, results):
        """Rows by field, of one state. The reference is a dictionary of field(), or a fixture's file."""
        with tempfile.TemporaryDirectory() as folder:
            theirs, report, oracle = (Path(folder) / name for name in ("theirs.h5", "report.h5", "reference.h5"))
            if isinstance(reference, Path):
                with h5py.File(reference) as fixture:
                    write_results(theirs, results, particles=len(fixture["state/position"]))
                call = [DECANT, "conform", reference, "--results", theirs]
            else:
                write_reference(oracle, {name: reference[name] for name in results})
                write_results(theirs, results)
                call = [DECANT, "conform", "--oracle", oracle, "--results", theirs]
            done = subprocess.run([*call, "--quiet", "--report", report], capture_output=True, text=True)
            if done.returncode not in (0, 1):
                sys.exit(f"decant conform ends with {done.returncode}: {done.stderr or done.stdout}")
            with h5py.File(report) as file:
                self.about["provenance"] = {"git_revision": file["provenance"].attrs["git_revision"].decode()}
                summary = {key: file["summary/" + key][:] for key in ("field", "verdict", *COLUMNS)}
        rows = {name.decode(): {"verdict": summary["verdict"][k].decode()} |
                {key: float(summary[key][k]) for key in COLUMNS}
                for k, name in enumerate(summary["field"]) if summary["verdict"][k] != b"not_run"}
        if rows.keys() != results.keys():
            sys.exit(f"given {sorted(results)}, judged {sorted(rows)}")
        return rows

    def compare(self, compared, against, state, reference, results, *, fault=None, mend=None, mended=None,
                control=None):
        """Judges every field of `results`. fault: {field: words} of those that have to fail. mended: what they give
        when mended as `mend` says, a text or one per field. control: results that have to fail, all of them; where none
        are given, off() of those that pass."""
        fault, mended = fault or {}, mended or {}
        passing = {name: mended.get(name, value) for name, value in results.items()
                   if name in mended or name not in fault}
        if control is None:
            control = {name: off(value) for name, value in passing.items()}
        particles, first = len(next(iter(results.values()))), self.judge(reference, results)
        second, third = (self.judge(reference, given) if given else {} for given in (mended, control))
        for name, row in first.items():
            entry = {"compared": compared, "with": against, "state": state, "particles": particles, "field": name,
                     **row, "fault": fault.get(name, "none")}
            self.expect(row, "fail" if name in fault else "pass", f"{compared}: {name}")
            for kind, found, wanted in (("mended", second, "pass"), ("control", third, "fail")):
                if name in found and (kind == "mended" or name in control):
                    self.expect(found[name], wanted, f"{compared}: {name}, {kind}")
                    entry |= {f"{kind}_{key}": found[name][key] for key in ("verdict", "score")}
            told = mend.get(name) if isinstance(mend, dict) else mend
            self.rows.append(entry | ({"mend": told} if name in second else {}))

    def expect(self, row, wanted, what):
        print(f"{row['verdict']:4} {row['score']:10.3g}  {what}")
        if row["verdict"] != wanted:
            self.wrong.append(f"{what}: {row['verdict']} ({row['score']:.3g}), expected {wanted}")

    def finish(self):
        def plain(value):  # JSON has no NaN
            return repr(value) if isinstance(value, float) and not np.isfinite(value) else value
        rows = [json.dumps({key: plain(value) for key, value in row.items()}, ensure_ascii=False) for row in self.rows]
        about = json.dumps(self.about, ensure_ascii=False, indent=1).removesuffix("\n}")
        self.out.write_text(about + ',\n "rows": [\n  ' + ",\n  ".join(rows) + "\n ]\n}\n", encoding="utf-8")
        sys.exit("\n".join(self.wrong) if self.wrong else 0)
