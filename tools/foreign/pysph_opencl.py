#!/usr/bin/env python3
"""Judges PySPH: its compiled Cython backend in double, and its OpenCL backend in fp32 on the CPU (PoCL).

Equations: summation density, and the momentum equation of Monaghan 1992 with artificial viscosity, written by us
in double; then the OpenCL backend against the Cython one."""

import numpy as np
from common import Table, block, pairs, total
from compyle.config import get_config
from pysph.base.utils import get_particle_array  # before the next one, which fails when it is first
from pysph.base.device_helper import DeviceHelper
from pysph.base.gpu_nnps import ZOrderGPUNNPS
from pysph.base.kernels import CubicSpline
from pysph.base.nnps import DomainManager, LinkedListNNPS
from pysph.sph.basic_equations import SummationDensity
from pysph.sph.wc.basic import MomentumEquation
from pysph.tools.sph_evaluator import SPHEvaluator
from results_file import field, pair_sums

ALPHA, BETA, SOUND, REST = 0.2, 0.1, 10.0, 1000.0


def spline(q):
    """Monaghan's cubic spline without its constant: value, size, slope, size of the slope."""
    near, far = np.maximum(1 - q, 0), np.maximum(2 - q, 0)
    return (far**3 / 4 - near**3, far**3 / 4 + near**3 + 0.75 * q * (2 * far**2 + 4 * near**2),
            3 * near**2 - 0.75 * far**2, 3 * near**2 + 0.75 * far**2 + q * (6 * near + 3 * far))


def reference(x, v, rho, p, m, h, side):
    """The density by summation; from the given one, accelerations. With what bounds a port in fp32."""
    n, norm = len(x), 1 / (np.pi * h**3)
    i, j, d, r = pairs(x, 2 * h, side, self_too=True)
    value, size = (norm * part for part in spline(r / h)[:2])
    condition, terms = pair_sums(n, i, j, m * size, both=False)
    i_, j_, d, r = (a[r > 0] for a in (i, j, d, r))
    slope, steep = (norm / h * part for part in spline(r / h)[2:])
    approach = ((v[i_] - v[j_]) * d).sum(axis=1)
    parts = (abs(v[i_] - v[j_]) * abs(d)).sum(axis=1)  # what the approach is a sum of
    drag = h / (r * r + 0.01 * h * h) * (approach < 0)
    mean = (rho[i_] + rho[j_]) / 2
    each = p[i_] / rho[i_]**2 + p[j_] / rho[j_]**2
    push = each + (-ALPHA * SOUND * drag * approach + BETA * (drag * approach)**2) / mean
    large = abs(each) + (ALPHA * SOUND * drag * parts + 2 * BETA * drag * drag * abs(approach) * parts) / mean
    unit = d / r[:, None]
    sums, number = pair_sums(n, i_, j_, (m * (abs(push) * steep + large * abs(slope)))[:, None] * unit, both=False)
    return {"density": (total(n, i, m * value), condition, terms),
            "acceleration": (total(n, i_, (-m * push * slope)[:, None] * unit), sums, number)}


def bounded(values, precision):
    return {key: field(value, condition=condition, terms=terms, precision=precision)
            for key, (value, condition, terms) in values.items()}


def run(x, v, rho, p, m, h, side, opencl):
    """Both fields by PySPH. What is given as fp32 numbers is stored without a rounding by either backend."""
    config = get_config()
    config.use_opencl, config.use_double = opencl, not opencl
    kernel, found = CubicSpline(dim=3), {}
    for key, equation, names in (("density", SummationDensity("fluid", ["fluid"]), ["rho"]),
                                 ("acceleration", MomentumEquation("fluid", ["fluid"], c0=SOUND, alpha=ALPHA,
                                                                   beta=BETA), ["au", "av", "aw"])):
        fluid = get_particle_array(
            name="fluid", m=m, h=h, rho=rho, p=p, cs=SOUND, additional_props=["cs", "dt_cfl", "dt_force"],
            **dict(zip("xyz", x.T.astype(float))), **dict(zip("uvw", v.T.astype(float))))
        if opencl:
            fluid.set_device_helper(DeviceHelper(fluid, backend="opencl"))
        backend = "opencl" if opencl else "cython"
        ends = {f"{axis}{end}": value for axis in "xyz" for end, value in (("min", 0.0), ("max", side))}
        domain = DomainManager(**ends, periodic_in_x=True, periodic_in_y=True, periodic_in_z=True,
                               backend=backend) if side else None
        evaluator = SPHEvaluator([fluid], [equation], dim=3, kernel=kernel, backend=backend, domain_manager=domain,
                                 nnps_factory=nnps_gpu if opencl else LinkedListNNPS)
        evaluator.evaluate()
        if opencl:
            fluid.gpu.pull(*names)
        columns = [np.array(fluid.get(name)) for name in names]  # of real particles, without copies beyond a period
        found[key] = columns[0] if len(columns) == 1 else np.stack(columns, 1)
    return {key: value.astype(np.float32) if opencl else value for key, value in found.items()}


def nnps_gpu(dim, particles, radius_scale, domain, cache):
    return ZOrderGPUNNPS(dim=dim, particles=particles, radius_scale=radius_scale, domain=domain, cache=cache,
                         backend="opencl")


def main():
    table = Table("PySPH", "pysph", "compyle", "cython", "pyopencl", "pocl-binary-distribution", "numpy")
    rng, cells, dx = np.random.default_rng(1), 14, 1 / 16
    m, h = float(np.float32(REST * dx**3)), 1.25 * dx
    for place, side, text in ((0.0, None, "jittered lattice at the origin"),
                              (50.0, None, "jittered lattice 50 m away"),
                              (0.0, cells * dx, "jittered lattice, periods along every axis")):
        x = (block(rng, cells, dx) + np.float32(place)).astype(np.float32)
        v = rng.normal(size=x.shape).astype(np.float32)
        rho = (REST * (1 + 0.01 * rng.uniform(-1, 1, len(x)))).astype(np.float32).astype(float)
        p = (SOUND**2 * (rho - REST)).astype(np.float32).astype(float)
        ours = reference(x.astype(float), v.astype(float), rho, p, m, h, side)
        double, single = (run(x, v, rho, p, m, h, side, opencl) for opencl in (False, True))
        table.compare("Cython backend, double", "Monaghan 1992, in double", text, bounded(ours, 2**-53), double)
        table.compare("OpenCL backend, fp32", "Monaghan 1992, in double", text, bounded(ours, None), single)
        theirs = {key: (double[key], *rest[1:]) for key, rest in ours.items()}
        table.compare("OpenCL backend, fp32", "their Cython backend, double", text, bounded(theirs, None), single)
    table.finish()


if __name__ == "__main__":
    main()
