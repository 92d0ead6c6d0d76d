"""Ports that tests judge: the example with a fault, one that only offers fields, one that keeps lists."""

import ctypes
import os
import time

import numpy as np
from numpy_port import NumpyPort
from numpy_sph import pairs

import decant


class Faulty(NumpyPort):
    def __init__(self, fault="none"):
        super().__init__()
        self.fault = fault

    def evaluate(self, given):
        fields = super().evaluate(given)
        n = len(self.x)
        match self.fault:
            case "sign":
                fields["pressure_acceleration"] = -fields["pressure_acceleration"]
            case "nan":
                fields["density"][n // 2] = np.nan
            case "unwritten":
                del fields["pressure"]
            case "shape":
                fields["density"] = fields["density"][1:]
            case "flat":
                fields["acceleration"] = fields["acceleration"].ravel()
            case "kind":
                fields["fluid_neighbor_count"] = fields["fluid_neighbor_count"].astype(float)
            case "unknown":
                fields["vorticity"] = fields["density"]
            case "text":
                fields["density"] = ["heavy"] * n
            case "raise":
                raise ZeroDivisionError("no luck")
        return fields

    def advance(self, substeps):
        match self.fault:
            case "abort":
                os.abort()
            case "segfault":
                ctypes.string_at(0)
            case "leave":
                os._exit(7)
            case "hang":
                time.sleep(1000)
        super().advance(substeps)
        if self.fault == "reports":
            self.report("capacity", 3, self.substep)
            self.report("escaped", 2, self.substep)


class Mended(Faulty):
    name = "Faulty"


class Signed(Faulty):
    name = "Faulty"

    def __init__(self):
        super().__init__("sign")


class FieldsOnly(decant.Port):
    offers = {"density"}

    def load(self, scene, walls, state):
        self.port = NumpyPort()
        self.port.load(scene, walls, state)

    def evaluate(self, given):
        fields = self.port.evaluate(given)
        return {name: fields[name] for name in ("density", "pressure")}


class Listing(NumpyPort):
    """Gives lists that are rebuilt every N substeps, and does not use them."""

    offers = NumpyPort.offers | {"lists", "rebuild"}

    def __init__(self, rebuild="1", skin="0"):
        super().__init__()
        self.every, self.skin = int(rebuild), float(skin)

    def load(self, scene, walls, state):
        super().load(scene, walls, state)
        self.start, self.built, self.rebuilds = state.substep, None, 0

    def advance(self, substeps):
        for _ in range(substeps):
            self.build_where_due()
            super().advance(1)

    def build_where_due(self):
        if self.built == self.substep or (self.substep - self.start) % self.every:
            return
        self.built = self.substep
        self.rebuilds += 1
        self.place_walls()

        class Wider:
            support_radius = self.scene.support_radius * (1 + self.skin)
            domain_min, domain_max = self.scene.domain_min, self.scene.domain_max

        self.kept = []
        for targets in (self.x, self.wall_x):
            i, j, _, _ = pairs(Wider, self.x, targets, np.array(self.scene.periodic))
            if targets is self.x:
                i, j = i[i != j], j[i != j]
            order = np.argsort(i, kind="stable")
            self.kept += [np.concatenate([[0], np.cumsum(np.bincount(i, minlength=len(self.x)))]), j[order]]

    def lists(self):
        self.build_where_due()
        return decant.Lists(self.built, *self.kept)

    def stage_times(self):
        return decant.StageTimes(build=1.5, build_calls=self.rebuilds, rebuilds=self.rebuilds)


class NotAPort:
    pass
