"""A whole port in NumPy, fp32, with cells of H, written from reference/README.md with numpy_sph.py.

decant conform --backend python:numpy_port.py:NumpyPort
"""

import numpy as np

import decant
from numpy_sph import F, kernels, pairs, total

np.seterr(invalid="ignore")  # what is not finite is reported


class NumpyPort(decant.Port):
    offers = {"density", "acceleration", "parts", "neighbors", "given", "boundary_volume", "walls", "step", "status"}
    device = "NumPy " + np.__version__

    volumes_of = None

    def load(self, scene, walls, state):
        self.scene, self.substep, self.walls = scene, state.substep, walls
        self.x, self.v = state.position.astype(F), state.velocity.astype(F)
        of = (scene.kernel, scene.support_radius, scene.periodic, walls.position.tobytes(), walls.container.tobytes())
        if of != self.volumes_of:  # the same scene comes again and again
            self.volumes_of = of
            self.find_volumes(scene, walls)

    def find_volumes(self, scene, walls):
        self.W, self.G, self.L = kernels(scene.kernel, scene.support_radius)
        local = walls.position.astype(F)
        i, j, _, r = pairs(scene, local, local, np.array(scene.periodic))
        same = walls.container[i] == walls.container[j]
        self.V = 1 / total(i[same], self.W(r[same]), len(walls))

    def poses(self):
        return [self.scene.pose(k, self.substep * self.scene.time_step) for k in range(self.scene.containers)]

    def place_walls(self):
        x, v = np.zeros(self.walls.position.shape), np.zeros(self.walls.position.shape)
        for k, pose in enumerate(self.poses()):
            own = self.walls.container == k
            x[own] = pose.to_world(self.walls.position[own])
            v[own] = pose.velocity_at(x[own])
        self.wall_x, self.wall_v = x.astype(F), v.astype(F)

    def densities(self):
        s, n = self.scene, len(self.x)
        self.place_walls()
        found = pairs(s, self.x, self.x, np.array(s.periodic))
        self.fluid = i, j, _, r = [part[found[0] != found[1]] for part in found]
        self.wall = a, b, _, rw = pairs(s, self.x, self.wall_x, np.array(s.periodic))
        self.facts = [np.bincount(i, minlength=n), np.bincount(i, j, n).astype(int),
                      np.bincount(a, minlength=n), np.bincount(a, b, n).astype(int)]  # fmt: skip
        m, rho0 = F(s.particle_mass), F(s.rest_density)
        return m * self.W(np.zeros(n, F)) + total(i, m * self.W(r), n) + total(a, rho0 * self.V[b] * self.W(rw), n)

    def pressures(self, density):
        s = self.scene
        p = s.eos_stiffness * ((density / s.rest_density) ** s.eos_exponent - 1)  # in double: it cancels
        return (p if s.allow_tension else np.maximum(p, 0)).astype(F)

    def parts(self, rho, p):
        s, n, m, rho0 = self.scene, len(self.x), F(self.scene.particle_mass), F(self.scene.rest_density)
        (i, j, d, r), (a, b, dw, rw), q = self.fluid, self.wall, p / (rho * rho)
        of = lambda i, size, vector: total(i, size[:, None] * vector, n)
        return [of(i, m * (q[i] + q[j]) * self.G(r), d),
                of(i, F(s.viscosity) / rho[i] * m / rho[j] * self.L(r), self.v[j] - self.v[i]),
                of(a, rho0 * self.V[b] * q[a] * self.G(rw), dw),
                of(a, F(s.wall_viscosity) / rho[a] * self.V[b] * self.L(rw), self.wall_v[b] - self.v[a])]  # fmt: skip

    def evaluate(self, given):
        rho = self.densities()
        rho = given.density.astype(F) if given and given.density is not None else rho
        own = self.pressures(rho)
        parts = self.parts(rho, given.pressure.astype(F) if given and given.pressure is not None else own)
        acceleration = sum(parts) + F(self.scene.gravity)
        self.tell(~np.isfinite(np.hstack([self.x, acceleration])).all(1), "non_finite")
        fields = {"boundary_volume": self.V, "density": rho, "pressure": own, "acceleration": acceleration}
        names = [f"{name}_acceleration" for name in ("pressure", "viscous", "wall_pressure", "wall_viscous")]
        return fields | dict(zip(names, parts)) | dict(zip(decant.COUNT_FIELDS, self.facts))

    def tell(self, wrong, what):
        if wrong.any():
            self.report(what, int(np.argmax(wrong)), self.substep)

    def advance(self, substeps):
        s, dt = self.scene, F(self.scene.time_step)
        low, high = np.array(s.domain_min, F), np.array(s.domain_max, F)
        for _ in range(substeps):
            rho = self.densities()
            self.v = self.v + dt * (sum(self.parts(rho, self.pressures(rho))) + F(s.gravity))
            self.x = self.x + dt * self.v
            self.x = np.where(s.periodic, self.x - (high - low) * np.floor((self.x - low) / (high - low)), self.x)
            self.substep += 1
            self.collide()
            finite = np.isfinite(np.hstack([self.x, self.v])).all(1)
            self.tell(~finite, "non_finite")
            self.tell(finite & (~np.array(s.periodic) & ((self.x < low) | (self.x > high))).any(1), "escaped")

    def collide(self):
        s = self.scene
        for k, pose in enumerate(self.poses()):
            for _ in range(2):
                phi, normal = s.distance(k, pose.to_local(self.x.astype(float)))
                hit = np.flatnonzero(phi < s.contact_distance)
                self.push_out(hit, phi[hit], normal[hit] @ pose.rotation.T, pose.velocity_at)
        if s.floor_height is not None:
            hit = np.flatnonzero(self.x[:, 2] - s.floor_height < s.contact_distance)
            up = np.tile([0.0, 0.0, 1.0], (len(hit), 1))
            self.push_out(hit, self.x[hit, 2] - s.floor_height, up, np.zeros_like)

    def push_out(self, hit, phi, normal, wall_velocity):
        """Those hit, at distance phi from a solid, out along its normal to the contact distance."""
        s = self.scene
        x = self.x[hit] + (s.contact_distance - phi)[:, None] * normal
        wall = wall_velocity(x)
        u = self.v[hit] - wall
        un = (u * normal).sum(1, keepdims=True)
        along, J = u - un * normal, -(1 + s.restitution) * un
        slip = np.linalg.norm(along, axis=1, keepdims=True)
        along *= np.maximum(0, 1 - s.friction * J / np.where(slip > 0, slip, 1))
        self.v[hit] = np.where(un < 0, wall + (un + J) * normal + along, self.v[hit])
        self.x[hit] = x

    def read(self):
        return self.x, self.v
