#!/usr/bin/env python3
"""Judges the kernels of SPlisHSPlasH's Python package (fp32), computed and looked up in its tables.

Reference: the shapes of Koschier et al., SPH tutorial 2019 (cubic spline), Müller et al. 2003 (poly6, spiky) and
Wendland 1995 (C2), normalised by quadrature, in double; q = r / support radius."""

import ctypes.util
import os
import sys

import numpy as np
from common import Kernel, Table
from results_file import field

if "LD_PRELOAD" not in os.environ and ctypes.util.find_library("GLX") and ctypes.util.find_library("GLdispatch"):
    # The package's own libGLdispatch and a libGLX of the system do not go together: the system's for both.
    os.environ["LD_PRELOAD"] = ctypes.util.find_library("GLdispatch")
    os.execv(sys.executable, [sys.executable, *sys.argv])
from pysplishsplash import SPHKernels  # noqa: E402

SHAPES = {"CubicKernel": [(1, 3, [2]), (0.5, 3, [-1])], "Poly6Kernel": [(1, 3, [1, 3, 3, 1])],
          "SpikyKernel": [(1, 3, [1])], "WendlandQuinticC2Kernel": [(1, 4, [1, 4])]}
CASES = [(name, 3, "") for name in SHAPES] + [("CubicKernel", 2, "2D"), ("WendlandQuinticC2Kernel", 2, "2D")]


def main():
    table = Table("SPlisHSPlasH, its kernels", "pysplishsplash", "numpy")
    radius, along = 0.1, np.array([3, -4, 0]) / 5
    computed = {}
    for tables in (False, True):
        for name, dim, suffix in CASES:
            theirs = getattr(SPHKernels.Precomputed if tables else SPHKernels, name + suffix)
            theirs.setRadius(radius)
            points = (np.linspace(0.0104, 0.9902, 197)[:, None] * radius * along).astype(np.float32)
            r = np.sqrt((points.astype(float)**2).sum(axis=1))
            w, size, slope, steep = Kernel(SHAPES[name], radius, dim)(r)
            unit = points / r[:, None]
            expected = {"W": field(w, condition=size, terms=1),
                        "gradient": field(slope[:, None] * unit, condition=steep[:, None] * abs(unit), terms=1)}
            found = {"W": np.array([theirs.W(point) for point in points], np.float32),
                     "gradient": np.stack([theirs.gradW(point) for point in points])}
            kind = ("Precomputed." if tables else "") + name + suffix
            worst = {key: abs(found[key] - f["values"]).max() / abs(f["values"]).max() for key, f in expected.items()}
            steps = "a table of 10,000 steps without interpolation: off by up to {:.1e} of the largest value"
            table.compare(kind, "its published shape, in double", "support radius 0.1, distances over the support",
                          expected, found, fault={key: steps.format(share) for key, share in worst.items()}
                          if tables else {}, mend=f"{name + suffix} instead", mended=computed.get(kind))
            computed["Precomputed." + kind] = found
    table.finish()


if __name__ == "__main__":
    main()
