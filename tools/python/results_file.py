#!/usr/bin/env python3
"""Writes the files by which `decant conform --results` judges a solver that is not linked.

    results_file.py ANY.h5 --out FILE.h5     the same content in the format that is read

The layouts are in oracle/formats/results.md. As a module: write_results, write_reference, pair_sums.
"""

import argparse
import os
import sys
from pathlib import Path

import h5py
import numpy as np

SCHEMA = 1
UNITS = {"boundary_volume": "m^3", "density": "kg/m^3", "pressure": "Pa", "acceleration": "m/s^2",
         "pressure_acceleration": "m/s^2", "viscous_acceleration": "m/s^2",
         "wall_pressure_acceleration": "m/s^2", "wall_viscous_acceleration": "m/s^2",
         "position": "m", "velocity": "m/s"}


def pair_sums(n, i, j, terms, kappa=0.0, both=True):
    """Condition sums and their numbers of terms, for a reference file.

    n particles; pair k adds terms[k] ([K], [K,3], …) to particle i[k] and, where `both`, the same
    size to j[k]. kappa is a term's own condition, r|f'|/f of a radial f. Returns sum |t|(1 + kappa)
    in double, [n], [n,3], …, and the number of terms, [n].
    """
    size = np.abs(np.asarray(terms, np.float64))
    size = size * (1 + np.asarray(kappa, np.float64).reshape((-1,) + (1,) * (size.ndim - 1)))
    sums, count = np.zeros((n,) + size.shape[1:]), np.zeros(n, np.int64)
    for index in (i, j) if both else (i,):
        np.add.at(sums, np.asarray(index), size)
        np.add.at(count, np.asarray(index), 1)
    return sums, count


def near_cutoff(position, radius, period=None, precision=2.0**-24, roundings=8):
    """Particles that own a pair which fp32 may find on the other side of the cutoff, [n]: their neighbor counts may
    differ by one. As each=near_cutoff(…) it is the tolerance of such a field.

    position: [n,D], m; radius: m; period: [D], m, 0 where an axis has none. All pairs are compared.
    """
    x = np.asarray(position, np.float64)
    period = np.zeros(x.shape[1]) if period is None else np.asarray(period, np.float64)
    slack = roundings * precision * (np.abs(x).max(initial=0) + radius)
    unsure = np.zeros(len(x))
    for k, place in enumerate(x):
        apart = x - place
        apart -= np.where(period > 0, period * np.round(apart / np.where(period > 0, period, 1)), 0)
        unsure[k] = (np.abs(np.sqrt((apart**2).sum(axis=1)) - radius) <= slack).sum()
    return unsure


def put(group, name, values, unit=None, **attributes):
    values = np.asarray(values)
    values = values.astype(np.int64 if values.dtype.kind in "iu" else
                           np.float32 if values.dtype == np.float32 else np.float64)
    data = group.create_dataset(name, data=values)
    if unit:
        attributes["unit"] = unit
    for key, value in attributes.items():
        if value is not None:
            data.attrs[key] = np.bytes_(value) if isinstance(value, str) else value


def whole_file(path, fill):
    """Writes aside, then renames. HDF5 1.8's format: its headers carry checksums."""
    path = Path(path)
    aside = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        with h5py.File(aside, "w", libver="v108") as file:
            fill(file)
        aside.replace(path)
    finally:
        aside.unlink(missing_ok=True)


def write_results(path, fields=None, staged=None, substep=None, *, states=None, id=None,
                  fixture_sha256=None, particles=None, device=None):
    """Results of a fixture (fields, staged, substep: dictionaries of arrays, any of them), or of
    several states of one's own: states = {name: {"fields": {…}, "id": […]}}."""
    def fill(file):
        file.attrs["decant_results"] = np.int64(SCHEMA)
        for key, text in (("fixture_sha256", fixture_sha256), ("device", device)):
            if text:
                file.attrs[key] = np.bytes_(text)
        if particles is not None:
            file.attrs["particles"] = np.int64(particles)
        if id is not None:
            put(file, "id", id)
        for group, values in (("fields", fields), ("staged", staged), ("substep", substep)):
            for name, value in (values or {}).items():
                put(file, f"{group}/{name}", value, UNITS.get(name) if states is None else None)
        for state, content in (states or {}).items():
            if "id" in content:
                put(file, f"{state}/id", content["id"])
            for name, value in content["fields"].items():
                put(file, f"{state}/fields/{name}", value)
    whole_file(path, fill)


def field(values, unit=None, *, condition=None, terms=None, precision=None, c=None,
          tolerance=None, relative=None, each=None, reference_precision=None):
    """One field of a reference file: see oracle/formats/results.md for what bounds it.

    tolerance: one for all values; each: one per value or per particle, as of what an earlier stage hands on.
    """
    return dict(values=values, unit=unit, condition=condition, terms=terms, precision=precision,
                c=c, tolerance=tolerance, relative=relative, each=each,
                reference_precision=reference_precision)


def write_reference(path, fields=None, *, id=None, position=None, states=None):
    """A reference of one's own: fields = {name: field(…)} of one state, or of several:
    states = {name: {"fields": {…}, "id": […], "position": […]}}. position: m, shown where a value fails."""
    def fill(file):
        file.attrs["decant_reference"] = np.int64(SCHEMA)
        for state, content in (states or {"": {"fields": fields, "id": id, "position": position}}).items():
            group = file.require_group(state) if state else file
            for name, unit in (("id", None), ("position", "m")):
                if content.get(name) is not None:
                    put(group, name, content[name], unit)
            for name, f in content["fields"].items():
                put(group, f"fields/{name}", f["values"], f["unit"], tolerance=f["tolerance"],
                    relative=f["relative"])
                if f["each"] is not None:
                    put(group, f"tolerance/{name}", np.asarray(f["each"], np.float64), f["unit"])
                if f["condition"] is None:
                    continue
                scalar = np.ndim(f["terms"]) == 0
                put(group, f"condition/{name}", f["condition"], f["unit"], c=f["c"],
                    precision=f["precision"], reference_precision=f["reference_precision"],
                    terms=f["terms"] if scalar else None)
                if not scalar:
                    put(group, f"terms/{name}", f["terms"])
    whole_file(path, fill)


def rewrite(source, target):
    """Copies attributes and datasets; strings become fixed-length."""
    def attributes(found, written):
        for key, value in found.attrs.items():
            written.attrs[key] = np.bytes_(value) if isinstance(value, (str, bytes)) else value

    def fill(file):
        with h5py.File(source, "r") as original:
            attributes(original, file)

            def copy(name, item):
                if isinstance(item, h5py.Dataset):
                    if item.dtype.kind not in "biuf":
                        raise TypeError(f"{source}: /{name} holds no numbers, but files of results hold nothing else")
                    put(file, name, item[()])
                else:
                    file.require_group(name)
                attributes(item, file[name])
            original.visititems(copy)
    whole_file(target, fill)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("source", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    arguments = parser.parse_args()
    if arguments.source.is_dir():
        raise IsADirectoryError(f"{arguments.source}: a folder, not an HDF5 file")
    try:
        rewrite(arguments.source, arguments.out)
    except TypeError as error:
        sys.exit(str(error))


if __name__ == "__main__":
    import one_line  # here: as a module this file needs no other of the folder

    one_line.run_main(main)
