"""What bounds by spread pass and catch, beside derived ones: python tests/package/spread_study.py RECORDING…

A correct port in fp32 and planted faults are judged by decant.spread (12 copies) and by the oracle's own tolerances.
"""

import sys

import numpy as np
from numpy_port import F, NumpyPort

import decant

FIELDS = [name for name in decant.REAL_FIELDS if name != "boundary_volume"]


class Planted(NumpyPort):
    """The example with a fault."""

    def __init__(self, fault="none"):
        super().__init__()
        self.fault = fault

    def find_volumes(self, scene, walls):
        super().find_volumes(scene, walls)
        if self.fault == "pi is 3.1416":
            W, G = self.W, self.G
            self.W, self.G = (lambda r: W(r) * F(np.pi / 3.1416)), (lambda r: G(r) * F(np.pi / 3.1416))
        if self.fault == "wall volumes are dx^3":
            self.V = np.full_like(self.V, scene.particle_spacing**3)

    def densities(self):
        rho = super().densities()
        i, j, d, r = self.fluid
        distance = {"nearest pair missing": 0.0, "pair at 0.9 H missing": 0.9}.get(self.fault)
        if distance is not None and len(i):
            k = np.argmin(np.abs(r - distance * self.scene.support_radius))
            rho[i[k]] -= F(self.scene.particle_mass) * self.W(r[k : k + 1])[0]
            self.fluid = tuple(np.delete(part, k, axis=0) for part in (i, j, d, r))
        if self.fault == "own term missing":
            rho = rho - F(self.scene.particle_mass) * self.W(np.zeros(1, F))
        if self.fault == "walls at rest":
            self.wall_v = np.zeros_like(self.wall_v)
        return rho.astype(np.float16).astype(F) if self.fault == "density in half precision" else rho

    def parts(self, rho, p):
        pressure, viscous, wall_pressure, wall_viscous = super().parts(rho, p)
        if self.fault == "viscosity 1 % too large":
            viscous = viscous * F(1.01)
        if self.fault == "viscosity 1e-4 too large":
            viscous = viscous * F(1.0001)
        if self.fault == "pressure force of opposite sign":
            pressure = -pressure
        return [pressure, viscous, wall_pressure, wall_viscous]


FAULTS = ("pi is 3.1416", "viscosity 1e-4 too large", "viscosity 1 % too large", "nearest pair missing",
          "pair at 0.9 H missing", "own term missing", "walls at rest", "wall volumes are dx^3",
          "density in half precision", "pressure force of opposite sign")  # fmt: skip


def solvers(fixture, port):
    """The oracle in double, and a port in fp32, as functions of position and velocity."""
    scene, substep = fixture.scene, fixture.state.substep
    oracle, walls = decant.Oracle(scene, fixture.state), scene.walls()

    def reference(inputs):
        oracle.load(decant.State(inputs["position"], inputs["velocity"], substep))
        fields = oracle.evaluate()
        return {name: fields[name] for name in FIELDS}

    def single(inputs):
        port.load(scene, walls, decant.State(inputs["position"], inputs["velocity"], substep))
        fields = port.evaluate(None)
        return {name: fields[name] for name in FIELDS}

    return reference, single


def study(name, others=()):
    """Values, how many a correct port may fail in by estimate, and of ports: how many fail, scores by spread and by
    derived tolerances. others: more correct ports."""
    fixture = decant.read_fixture(name)
    inputs = {"position": fixture.state.position, "velocity": fixture.state.velocity}
    reference, single = solvers(fixture, Planted())
    bounds = decant.spread(reference, inputs, copies=12, single=single)
    derived = decant.Oracle(fixture.scene, fixture.state).tolerance()

    def judged(port):
        function = solvers(fixture, port)[1]
        verdicts, found, worst = decant.judge(function, bounds, inputs), function(inputs), 0.0
        for field in FIELDS:
            error = np.abs(found[field] - fixture.fields[field])
            with np.errstate(divide="ignore", invalid="ignore"):
                worst = max(worst, float(np.where(error > 0, error / derived[field], 0).max(initial=0)))
        return sum(v.beyond for v in verdicts), max(v.score for v in verdicts), worst

    correct = {"correct, sums in double": Planted()} | {f"correct, {type(p).__name__}": p for p in others}
    return {
        "recording": name,
        "values": sum(bound.value.size for bound in bounds.values()),
        "expected": sum(bound.false_alarms * bound.value.size for bound in bounds.values()),
        "correct": {label: judged(port) for label, port in correct.items()},
        "faults": {fault: judged(Planted(fault)) for fault in FAULTS},
    }


def main():
    from warp_port import WarpPort

    found = [study(name, [WarpPort()]) for name in sys.argv[1:]]
    print("Ports judged by spread (12 copies): values that fail; largest score by spread / by derived tolerances.\n")
    print(f"{'':34}" + "".join(f"{f['recording']:>34}" for f in found))
    print(f"{'values':34}" + "".join(f"{f['values']:>34,}" for f in found))
    print(f"{'failing of a correct one, at most':34}" + "".join(f"{f['expected']:>34.2g}" for f in found))
    for kind in ("correct", "faults"):
        for label in found[0][kind]:
            rows = [f[kind][label] for f in found]
            print(f"{label:34}" + "".join(f"{f'{n:,}; {a:.3g} / {b:.3g}':>34}" for n, a, b in rows))


if __name__ == "__main__":
    main()
