#!/usr/bin/env python3
"""Judges jax-sph: its kernels, one evaluation of its weakly compressible solver, and its cell list.

Kernels: the published shapes, normalised by quadrature. Solver: Adami, Hu and Adams 2012, equations 6 to 8."""

import sys
import types

import jax
import jax.numpy as jnp
import numpy as np
from common import CONTROL, Kernel, Table, block, pairs, total
from results_file import field, pair_sums

sys.modules["pyvista"] = types.ModuleType("pyvista")  # jax-sph imports it for pictures, of which there are none
from jax_sph import eos, kernel, partition, solver  # noqa: E402
from jax_sph.jax_md import space  # noqa: E402

# Parts of the kernels; where 1-D differs it is given apart.
SHAPES = {"Cubic": [[(2, 3, [2]), (1, 3, [-1])]], "Quintic": [[(3, 5, [243]), (2, 5, [-192]), (1, 5, [15])]],
          "WendlandC2": [[(2, 4, [1, 2])], [(2, 3, [1, 1.5])]],
          "WendlandC4": [[(2, 6, [1, 3, 35 / 12])], [(2, 5, [1, 2.5, 2])]],
          "WendlandC6": [[(2, 8, [1, 4, 6.25, 4])], [(2, 7, [1, 3.5, 4.75, 2.625])]]}


def judge_kernels(table):
    h = 0.1
    for name in SHAPES:
        values, results, mended = {}, {}, {}
        for dim in (1, 2, 3):
            ours, theirs = Kernel(SHAPES[name][-1 if dim == 1 else 0], h, dim), getattr(kernel, f"{name}Kernel")(h, dim)
            r = np.linspace(0.005, 0.995, 199).astype(np.float32) * np.float32(ours.cutoff)
            w, size, slope, steep = ours(r.astype(float))
            for label, value, bound, call in (("W", w, size, theirs.w), ("W'", slope, steep, theirs.grad_w)):
                key = f"{label} {dim}-D"
                values[key] = field(value, condition=bound, terms=1)
                results[key] = np.asarray(jax.vmap(call)(r))
                if (name, dim) == ("Quintic", 3):
                    mended[key] = results[key] * np.float32(359 / 360)
        table.compare(f"{name}Kernel", "its published shape, normalised by quadrature, in double",
                      "h = 0.1, distances over the support", values, results, mend="their output × 359/360",
                      fault=dict.fromkeys(mended, "constant 3/(359π) instead of 1/(120π): the integral is 360/359"),
                      mended=mended)


def particles(side, cells, jitter):  # in steps of 2^-18: differences and images are exact in fp32
    return np.round(block(np.random.default_rng(1), cells, side / cells, jitter) * 2**18) / np.float32(2**18)


def judge_solver(table, side, cells, jitter, fixed):
    """The density given (fixed) and what follows from it, or the density by summation."""
    x, dx = particles(side, cells, jitter), side / cells
    n, rho0, c, viscosity = len(x), 1.0, 10.0, 0.01
    k = 2 * np.pi * x.astype(float)
    u = np.stack([np.sin(k[:, 0]) * np.cos(k[:, 1]) * np.cos(k[:, 2]),
                  -np.cos(k[:, 0]) * np.sin(k[:, 1]) * np.cos(k[:, 2]), np.zeros(n)], 1).astype(np.float32)
    ours, m = Kernel(SHAPES["Quintic"][0], dx, 3), float(np.float32(rho0 * dx**3))
    displacement, _ = space.periodic(np.full(3, side, np.float32))
    stiffness = c * c * rho0
    i, j, d, r = pairs(x, ours.cutoff, side, self_too=True)
    w, size, _, _ = ours(r)
    condition, terms = pair_sums(n, i, j, m * size, both=False)
    rho = total(n, i, m * w)
    summed = {"density": field(rho, condition=condition, terms=terms),
              "pressure": field(stiffness * (rho / rho0 - 1), condition=stiffness * (condition + 2 * rho) / rho0,
                                terms=terms)}
    given = rho.astype(np.float32)
    i, j, d, r = (a[r > 0] for a in (i, j, d, r))
    _, _, slope, steep = ours(r)
    V, p, exact = m / given.astype(float), stiffness * (given / rho0 - 1.0), given.astype(float)
    mean = (exact[j] * p[i] + exact[i] * p[j]) / (exact[i] + exact[j])
    each = ((V[i]**2 + V[j]**2) / m / r)[:, None]
    push, drag = mean[:, None] * -d, viscosity * (u[i].astype(float) - u[j])
    large = 2 * stiffness * abs(d)  # p is a difference of numbers of the size of the stiffness
    condition, terms = pair_sums(n, i, j, each * ((steep + abs(slope))[:, None] * (abs(push) + abs(drag))
                                                  + abs(slope)[:, None] * large), both=False)
    staged = {"acceleration": field(total(n, i, each * slope[:, None] * (push + drag)), condition=condition,
                                    terms=terms)}

    def run(factor):
        sph = solver.WCSPH(displacement, eos.TaitEoS(stiffness, rho0, 0.0, 1.0), lambda r: 0 * r, dx, 3, 0.0, c,
                           is_rho_evol=fixed, kernel="QSK")  # dt = 0: a density evolved is the one given
        sph._kernel_fn._sigma *= factor
        ones, none = np.ones(n, np.float32), np.zeros_like(x)
        state = dict(r=x, tag=np.zeros(n, int), mass=m * ones, eta=viscosity * ones, u=u, v=u, dudt=none, dvdt=none,
                     rho=given, drhodt=0 * ones, p=0 * ones, nw=none, kappa=ones, Cp=ones, T=ones, dTdt=0 * ones)
        edges = types.SimpleNamespace(idx=np.stack(pairs(x, ours.cutoff, side, self_too=True)[:2]))
        return {key: np.asarray(value) for key, value in sph.forward_wrapper()(state, edges).items()}

    expected, names = (staged, {"acceleration": "dudt"}) if fixed else (summed, {"density": "rho", "pressure": "p"})
    found, mended = ({key: run(factor)[name] for key, name in names.items()} for factor in (1, 359 / 360))
    share = {key: np.median(abs(found[key] - f["values"])) / np.median(abs(f["values"])) for key, f in expected.items()}
    control = {key: value * np.float64(1 + CONTROL) + (key == "pressure") * CONTROL * stiffness
               for key, value in mended.items()}  # pressure: as of a density off by CONTROL
    table.compare("WCSPH, quintic spline, " + ("density given" if fixed else "density by summation"),
                  "Adami et al. 2012, in double", f"3-D Taylor-Green flow, periodic; lattice jittered by {jitter} dx",
                  expected, found, fault={key: f"that kernel: off by {part:.2%} of its median size"
                                          for key, part in share.items()},
                  mend="kernel._sigma × 359/360 before the call", mended=mended, control=control)


def judge_cell_list(table, x, side, cutoff):
    displacement, shift = space.periodic(np.full(3, side, np.float32))
    x[np.argmin(x[:, 0]), 0] = 0
    moved = np.asarray(shift(x, np.float32([-1e-9, 0, 0]) * (x[:, :1] == 0)))
    i, _, _, r = pairs(moved, cutoff, side)
    assert abs(pairs(moved, cutoff + 1e-4, side)[3] - cutoff).min() > 1e-7, "a pair at the cutoff: its count is open"
    expected = {"neighbor_count": field(np.bincount(i, minlength=len(x)))}

    def count(x, backend):
        search = partition.neighbor_list(displacement, np.full(3, side), r_cutoff=cutoff, backend=backend,
                                         capacity_multiplier=1.5, mask_self=True, num_particles_max=len(x),
                                         pbc=np.full(3, True), format=partition.NeighborListFormat.Sparse)
        first = np.asarray(search.allocate(jnp.asarray(x), num_particles=len(x)).idx[0])
        return {"neighbor_count": np.bincount(first[first < len(x)], minlength=len(x))}

    for backend in ("jaxmd_vmap", "jaxmd_scan", "matscipy"):
        found, mended = count(moved, backend), count(np.where(moved < side, moved, moved - side), backend)
        lost = found["neighbor_count"] - expected["neighbor_count"]["values"]
        fails = backend != "matscipy"
        wrong = f"x = side is put into a cell of another row: {(lost != 0).sum()} particles with a wrong count"
        table.compare(f"neighbor_list, backend {backend}", "all pairs, in double",
                      "periodic; a particle at x = 0 moved by -1e-9 with space.periodic's shift: in fp32 to x = side",
                      expected, found, fault={"neighbor_count": wrong} if fails else {},
                      mend="x = side set to 0 before the call", mended=mended if fails else {})


def main():
    table = Table("jax-sph", "jax-sph", "jax", "jaxlib", "numpy", "matscipy")
    judge_kernels(table)
    side, cells = 1.0, 14
    judge_solver(table, side, cells, 0.05, fixed=False)
    judge_solver(table, side, cells, 0.2, fixed=True)
    judge_cell_list(table, particles(side, cells, 0.2), side, 3 * side / cells)
    table.finish()


if __name__ == "__main__":
    main()
