"""The sums over pairs in NVIDIA Warp, on a GPU where there is one; contact and the rest as in numpy_port.py.

decant conform --backend python:warp_port.py:WarpPort
"""

import numpy as np
import warp as wp

from numpy_port import F, NumpyPort

wp.config.quiet = True


@wp.struct
class Constants:
    family: int  # 0 cubic spline, 1 Wendland C2, 2 Müller 2003
    H: float
    mass: float
    rest_density: float
    viscosity: float
    wall_viscosity: float
    period: wp.vec3  # 0 where an axis is not periodic
    images: wp.vec3i  # to either side, along each axis
    walls: int  # how many particles


@wp.func
def W(c: Constants, r: float):
    h = 0.5 * c.H
    q, u, w = r / h, wp.max(0.0, 2.0 - r / h), 1.0 / (wp.pi * h * h * h)
    if c.family == 2:
        return 315.0 / 512.0 * w * wp.pow(wp.max(0.0, 1.0 - 0.25 * q * q), 3.0)
    if c.family == 1:
        return 21.0 / 256.0 * w * u * u * u * u * (2.0 * q + 1.0)
    if q < 1.0:
        return w * (1.0 - q * q * (1.5 - 0.75 * q))
    return w * 0.25 * u * u * u


@wp.func
def G(c: Constants, r: float):
    h = 0.5 * c.H
    q, u, g = r / h, wp.max(0.0, 2.0 - r / h), 1.0 / (wp.pi * h * h * h * h * h)
    if c.family == 2:
        return 45.0 / 64.0 * g * u * u / wp.max(q, 1.0e-12) * float(q > 0.0)
    if c.family == 1:
        return 105.0 / 128.0 * g * u * u * u
    if q < 1.0:
        return g * (3.0 - 2.25 * q)
    return g * 0.75 * u * u / q


@wp.func
def L(c: Constants, r: float):
    if c.family == 2:
        return 45.0 / (wp.pi * wp.pow(c.H, 6.0)) * wp.max(0.0, c.H - r)
    return 2.0 * r * r * G(c, r) / (r * r + 0.0025 * c.H * c.H)


@wp.kernel
def densities(c: Constants, fluid: wp.uint64, walls: wp.uint64, x: wp.array(dtype=wp.vec3),
              wall_x: wp.array(dtype=wp.vec3), V: wp.array(dtype=float),
              density: wp.array(dtype=float), facts: wp.array2d(dtype=wp.int64)):  # fmt: skip
    i = wp.tid()
    xi = x[i]
    rho = c.mass * W(c, 0.0)
    for a in range(-c.images[0], c.images[0] + 1):
        for b in range(-c.images[1], c.images[1] + 1):
            for d in range(-c.images[2], c.images[2] + 1):
                image = wp.cw_mul(c.period, wp.vec3(float(a), float(b), float(d)))
                for j in wp.hash_grid_query(fluid, xi + image, c.H):
                    xij = xi - x[j] + image
                    if j != i and wp.dot(xij, xij) < c.H * c.H:
                        rho += c.mass * W(c, wp.length(xij))
                        facts[0, i] = facts[0, i] + wp.int64(1)
                        facts[1, i] = facts[1, i] + wp.int64(j)
                if c.walls > 0:
                    for k in wp.hash_grid_query(walls, xi + image, c.H):
                        xik = xi - wall_x[k] + image
                        if wp.dot(xik, xik) < c.H * c.H:
                            rho += c.rest_density * V[k] * W(c, wp.length(xik))
                            facts[2, i] = facts[2, i] + wp.int64(1)
                            facts[3, i] = facts[3, i] + wp.int64(k)
    density[i] = rho


@wp.kernel
def forces(c: Constants, fluid: wp.uint64, walls: wp.uint64, x: wp.array(dtype=wp.vec3), v: wp.array(dtype=wp.vec3),
           wall_x: wp.array(dtype=wp.vec3), wall_v: wp.array(dtype=wp.vec3), V: wp.array(dtype=float),
           rho: wp.array(dtype=float), p: wp.array(dtype=float), parts: wp.array2d(dtype=wp.vec3)):  # fmt: skip
    i = wp.tid()
    xi, vi, qi = x[i], v[i], p[i] / (rho[i] * rho[i])
    for a in range(-c.images[0], c.images[0] + 1):
        for b in range(-c.images[1], c.images[1] + 1):
            for d in range(-c.images[2], c.images[2] + 1):
                image = wp.cw_mul(c.period, wp.vec3(float(a), float(b), float(d)))
                for j in wp.hash_grid_query(fluid, xi + image, c.H):
                    xij = xi - x[j] + image
                    r = wp.length(xij)
                    if j != i and wp.dot(xij, xij) < c.H * c.H:
                        parts[0, i] = parts[0, i] + c.mass * (qi + p[j] / (rho[j] * rho[j])) * G(c, r) * xij
                        parts[1, i] = parts[1, i] + c.viscosity / rho[i] * c.mass / rho[j] * L(c, r) * (v[j] - vi)
                if c.walls > 0:
                    for k in wp.hash_grid_query(walls, xi + image, c.H):
                        xik = xi - wall_x[k] + image
                        r = wp.length(xik)
                        if wp.dot(xik, xik) < c.H * c.H:
                            parts[2, i] = parts[2, i] + c.rest_density * V[k] * qi * G(c, r) * xik
                            parts[3, i] = parts[3, i] + c.wall_viscosity / rho[i] * V[k] * L(c, r) * (wall_v[k] - vi)


class WarpPort(NumpyPort):
    device = f"{wp.get_preferred_device().name}, Warp {wp.__version__}"

    def load(self, scene, walls, state):
        super().load(scene, walls, state)
        self.c = c = Constants()
        c.family = ("cubic_spline", "wendland_c2", "mueller2003").index(scene.kernel)
        c.H, c.mass, c.rest_density = scene.support_radius, scene.particle_mass, scene.rest_density
        c.viscosity, c.wall_viscosity, c.walls = scene.viscosity, scene.wall_viscosity, len(walls)
        c.period = wp.vec3(*np.where(scene.periodic, np.subtract(scene.domain_max, scene.domain_min), 0))
        c.images = wp.vec3i(*np.where(scene.periodic, 1, 0).tolist())
        self.on_device = {"V": wp.array(self.V, dtype=float)}
        self.grids = [wp.HashGrid(64, 64, 64) for _ in range(2)]

    def densities(self):
        n, put = len(self.x), lambda values: wp.array(values, dtype=wp.vec3)
        self.place_walls()
        self.facts = np.zeros((4, n), np.int64)
        if n == 0:
            return np.zeros(0, F)
        self.on_device |= {"x": put(self.x), "wall_x": put(self.wall_x), "wall_v": put(self.wall_v)}
        self.grids[0].build(self.on_device["x"], self.c.H)
        if self.c.walls:
            self.grids[1].build(self.on_device["wall_x"], self.c.H)
        density, facts = wp.zeros(n, dtype=float), wp.zeros((4, n), dtype=wp.int64)
        inputs = [self.c, self.grids[0].id, self.grids[1].id, *(self.on_device[key] for key in ("x", "wall_x", "V"))]
        wp.launch(densities, n, inputs, [density, facts])
        self.facts = facts.numpy()
        return density.numpy()

    def parts(self, rho, p):
        n = len(self.x)
        parts = wp.zeros((4, n), dtype=wp.vec3)
        if n:
            x, *of_walls = (self.on_device[key] for key in ("x", "wall_x", "wall_v", "V"))
            v, rho, p = wp.array(self.v, dtype=wp.vec3), wp.array(rho, dtype=float), wp.array(p, dtype=float)
            wp.launch(forces, n, [self.c, self.grids[0].id, self.grids[1].id, x, v, *of_walls, rho, p], [parts])
        return list(parts.numpy().reshape(4, n, 3))
