#!/usr/bin/env bash
# yt reads no particle from an openPMD file: it lists their fields, counts them, and returns empty arrays.
#
# Seen with   yt 4.4.3, openpmd-api 0.17.1.post4, h5py 3.16.0, numpy 2.4.6; yt 4.1.4 (h5py 3.8.0) and 4.3.1 alike.
# Behavior    An openPMD HDF5 file (1.0.1 or 1.1.0) written by openPMD-api, with or without a mesh, with or without
#             particle patches. yt lists every particle field and its particle_type_counts has the right number;
#             every particle array it returns has no elements, a deposited particle count is 0 in every cell. No
#             error, and no warning that speaks of particles. The mesh is read, and openPMD-viewer 1.11.0 and
#             openPMD-api read all particles.
# Cause       The particles of a species are looked up with a path that begins with "/". h5py takes that from the
#             root of the file and not from the species' group; the KeyError is caught as "no particles here".
# Output seen as asserted below.
# Why         Comparing two runs through yt compares empty arrays: sums are 0 on both sides, "all equal" is true,
#             norms of differences are 0. Check the number of values read and not only the number announced.
set -euo pipefail
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --no-compile --disable-pip-version-check --only-binary=:all: \
    yt==4.4.3 openpmd-api==0.17.1.post4 h5py==3.16.0 numpy==2.4.6
cd "$dir"
"$dir/venv/bin/python" -W ignore - <<'PY'
import logging
import os

import h5py
import numpy as np
import openpmd_api as io
import yt

warnings = []


class Keep(logging.Handler):
    def emit(self, record):
        warnings.append(record.getMessage())


yt.set_log_level("warning")
keep = Keep(level=logging.WARNING)
logging.getLogger("yt").addHandler(keep)

n = 20
position = 0.1 + 0.8 * np.random.default_rng(0).random((n, 3))
density = 1000.0 + np.arange(n)


def put(record, values):
    record.reset_dataset(io.Dataset(values.dtype, values.shape))
    record.store_chunk(values)


def write(folder, version, mesh, patches):
    os.mkdir(folder)
    series = io.Series(f"{folder}/data_%T.h5", io.Access.create)
    series.set_openPMD(version)
    step = series.iterations[0]
    fluid = step.particles["fluid"]
    for k, axis in enumerate("xyz"):
        put(fluid["position"][axis], position[:, k].copy())
        fluid["positionOffset"][axis].reset_dataset(io.Dataset(np.dtype("f8"), [n]))
        fluid["positionOffset"][axis].make_constant(0.0)
    for name in ("position", "positionOffset"):
        fluid[name].unit_dimension = {io.Unit_Dimension.L: 1}
    put(fluid["density"], density)
    if patches:
        one = fluid.particle_patches
        for name, value in (("numParticles", n), ("numParticlesOffset", 0)):
            one[name].reset_dataset(io.Dataset(np.dtype("u8"), [1]))
            one[name].store(0, np.array([value], "u8"))
        for name, value in (("offset", 0.0), ("extent", 1.0)):
            for axis in "xyz":
                one[name][axis].reset_dataset(io.Dataset(np.dtype("f8"), [1]))
                one[name][axis].store(0, np.array([value]))
    if mesh:
        grid = step.meshes["rho"]
        grid.axis_labels, grid.grid_spacing, grid.grid_global_offset = list("xyz"), [0.25] * 3, [0.0] * 3
        put(grid, np.ones((4, 4, 4)))
    step.close()
    series.close()
    return f"{folder}/data_0.h5"


def by_openpmd_api(folder):
    series = io.Series(f"{folder}/data_%T.h5", io.Access.read_only)
    values = series.iterations[0].particles["fluid"]["density"][:]
    series.flush()
    return values


print("yt", yt.__version__, "openPMD-api", io.__version__, "h5py", h5py.__version__)
cases = [("1.0.1", True, False), ("1.0.1", True, True)]  # without a mesh no meshesPath, which 1.0 requires
cases += [("1.1.0", mesh, patches) for mesh in (False, True) for patches in (False, True)]
for version, mesh, patches in cases:
    folder = f"{version}-mesh{mesh:d}-patches{patches:d}"
    path = write(folder, version, mesh, patches)
    assert np.array_equal(by_openpmd_api(folder), density)
    with h5py.File(path) as file:
        assert file.attrs["openPMD"] in (version, version.encode())
        assert np.array_equal(file["data/0/particles/fluid/density"][:], density)
    warnings.clear()
    data = yt.load(path)
    everything = data.all_data()
    listed = ("io", "particle_density") in data.field_list
    sizes = {name: everything["io", name].size for name in ("particle_density", "particle_position_x")}
    said = [w for w in warnings if "article" in w]
    line = f"{folder}: field listed {listed}, announced {data.particle_type_counts}, read {sizes}"
    if mesh:
        cells, deposited = everything["openPMD", "rho"], everything["deposit", "io_count"]
        line += f", mesh values {cells.size}, deposited {float(deposited.sum()):g}"
        assert cells.size == 64 and deposited.size == 64 and deposited.sum() == 0
    print(line, said or "")
    assert listed and data.particle_type_counts == {"io": n} and not said
    assert set(sizes.values()) == {0}

inside = {("io", f"particle_position_{axis}"): position[:, k] for k, axis in enumerate("xyz")}
inside["io", "particle_density"] = density
data = yt.load_particles(inside, length_unit=1.0, bbox=np.array([[0.0, 1.0]] * 3))
print("the same arrays handed to yt.load_particles:", data.all_data()["io", "particle_density"].size)
assert data.all_data()["io", "particle_density"].size == n
PY
