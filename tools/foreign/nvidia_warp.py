#!/usr/bin/env python3
"""Judges the SPH example in the wheel of NVIDIA Warp, on its CPU device: its kernels, launched on states of ours.

The reference is Müller, Charypar and Gross 2003, equations 3, 10, 12, 14, 20 to 22, which the example cites."""

import numpy as np
import warp as wp
from common import Table, block, pairs, total
from results_file import field, pair_sums
from warp.examples.core import example_sph as theirs

PAPER = "Müller et al. 2003, in double"
REST, STIFFNESS, VISCOSITY = 1.0, 20.0, 0.025


def reference(x, v, h, mass, rho=None):
    """Density; and, given a density, accelerations by pressure and by viscosity."""
    x, v, n = x.astype(float), v.astype(float), len(x)
    if rho is None:
        i, j, _, r = pairs(x, h, self_too=True)
        gap, norm = h * h - r * r, 315 * mass / (64 * np.pi * h**9)
        c, terms = pair_sums(n, i, j, norm * (gap**3 + 6 * h * h * gap**2), both=False)
        return {"density": field(total(n, i, norm * gap**3), "kg/m^3", condition=c, terms=terms)}
    i, j, d, r = pairs(x, h)
    rho, norm = rho.astype(float), 45 * mass / (np.pi * h**6)
    p, size = STIFFNESS * (rho - REST), STIFFNESS * (rho + REST)  # size: what p is a difference of
    apart = r > 0  # the gradient has no direction at r = 0: taken as zero, as the field is odd
    unit = np.where(apart, d.T / np.where(apart, r, 1), 0).T

    def push(p, radial):
        return ((p[i] + p[j]) / (2 * rho[j]) / rho[i] * norm * radial)[:, None] * unit
    drag = (VISCOSITY * norm / rho[j] / rho[i])[:, None] * (v[j] - v[i])
    c_push, n_push = pair_sums(n, i, j, push(size, (h - r)**2 + 2 * h * (h - r)), both=False)
    c_drag, n_drag = pair_sums(n, i, j, drag * (h - r + h)[:, None], both=False)
    return {"pressure_acceleration": field(total(n, i, push(p, (h - r)**2)), "m/s^2", condition=c_push, terms=n_push),
            "viscous_acceleration": field(total(n, i, drag * (h - r)[:, None]), "m/s^2", condition=c_drag,
                                          terms=n_drag)}


def run(example, x, v, rho=None):
    """The same fields by the example's kernels."""
    vectors = [wp.array(a, dtype=wp.vec3, device="cpu") for a in (x, v, np.zeros_like(x))]
    density = wp.array(np.zeros(len(x)) if rho is None else rho, dtype=float, device="cpu")
    example.grid.build(vectors[0], example.smoothing_length)
    h = example.smoothing_length
    if rho is None:
        wp.launch(theirs.compute_density, dim=len(x), device="cpu",
                  inputs=[example.grid.id, vectors[0], density, example.density_normalization, h])
        return {"density": density.numpy()}
    found = {}
    for name, push, drag in (("pressure", 1, 0), ("viscous", 0, 1)):
        wp.launch(theirs.get_acceleration, dim=len(x), device="cpu", inputs=[
            example.grid.id, vectors[0], vectors[1], density, vectors[2], example.isotropic_exp,
            example.base_density, 0.0, push * example.pressure_normalization,
            drag * example.viscous_normalization, h])
        found[f"{name}_acceleration"] = vectors[2].numpy().copy()
    return found


def main():
    wp.config.quiet = True
    wp.init()
    table = Table("NVIDIA Warp, examples/core/example_sph.py", "warp-lang", "numpy")
    with wp.ScopedDevice("cpu"):
        example = theirs.Example(stage_path=None)
    h, mass, rng = example.smoothing_length, example.particle_mass, np.random.default_rng(1)
    own = example.x.numpy()[:4000]
    initial = reference(own, own, h, mass)
    table.compare("density", PAPER, f"the example's own initial state, first 4,000 particles: mean density "
                  f"{initial['density']['values'].mean():.3f}, below the rest density of 1, so that p < 0", initial,
                  run(example, own, own))
    for share in (2, 8):
        x, v = block(rng, 12, h / share), rng.normal(size=(12**3, 3)).astype(np.float32)
        text = f"jittered lattice, dx = h/{share}"
        expected = reference(x, v, h, mass)
        table.compare("density", PAPER, text, expected, run(example, x, v))
        given = expected["density"]["values"].astype(np.float32)
        found = run(example, x, v, given)
        table.compare("accelerations from a given density", PAPER,
                      f"{text}; p > 0 at {(given > REST).mean():.0%} of the particles",
                      reference(x, v, h, mass, given), found,
                      fault={"pressure_acceleration": "opposite sign: p > 0 attracts, p < 0 repels"},
                      mend="their output × -1", mended={"pressure_acceleration": -found["pressure_acceleration"]})

    v, rho = np.eye(3, dtype=np.float32), np.full(3, 1.5, np.float32)
    for second, text in ((8, "two particles in the same place, one beside them"),
                         (np.nextafter(np.float32(8), np.float32(9)), "the same, the second moved by one ulp")):
        x = np.array([[8, 8, 8], [second, 8, 8], [8.25, 8, 8]], np.float32)
        found = run(example, x, v, rho)["pressure_acceleration"] * np.float32(-1)
        table.compare("pressure_acceleration × -1", PAPER + "; no force at r = 0", text, reference(x, v, h, mass, rho),
                      {"pressure_acceleration": found}, fault={} if second != 8 else {
                          "pressure_acceleration": "NaN at r = 0: x_ij is divided by its length unguarded"})
    table.finish()


if __name__ == "__main__":
    main()
