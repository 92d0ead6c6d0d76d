#!/usr/bin/env bash
# VTK's VTKHDF reader: with UseCache a step that is shown again has its own values on another step's points.
#
# Seen with   vtk 9.5.2, h5py 3.12.1, numpy 2.1.3; 9.4.2 and 9.6.2 alike, 9.7.2 is right.
# Behavior    PolyData with Steps whose points move, read back and forth. With UseCache on (the default is off) the
#             step that was read first comes back with the points of the step shown before it and with its own point
#             data. No error, no warning.
# Output seen three steps of four points, x = a = 0 to 3, 4 to 7, 8 to 11, requests 0, 1, 2, 1, 0. The last one gives
#             x = 0 1 2 3, a = 0 1 2 3 without the cache; x = 4 5 6 7, a = 0 1 2 3 with it.
# Why         Particles move and their number does not: who plays frames back and forth, or compares two runs frame by
#             frame through VTK, sees densities at the places of another time.
set -euo pipefail

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet --disable-pip-version-check vtk==9.5.2 h5py==3.12.1 numpy==2.1.3
cat >"$work/show.py" <<'PYTHON'
import sys

import h5py
import numpy as np
import vtk
from vtk.util.numpy_support import vtk_to_numpy

steps, points = 3, 4
path = sys.argv[1]
with h5py.File(path, "w") as file:
    root = file.create_group("VTKHDF")
    root.attrs["Version"] = np.array([2, 0])
    root.attrs.create("Type", np.bytes_("PolyData"), dtype="S8")
    root["NumberOfPoints"] = np.full(steps, points)
    position = np.zeros((steps * points, 3), "f4")
    position[:, 0] = np.arange(steps * points)
    root["Points"] = position
    root.create_group("PointData")["a"] = np.arange(steps * points, dtype="f8")
    for kind in ("Vertices", "Lines", "Polygons", "Strips"):
        count = points if kind == "Vertices" else 0
        cells = root.create_group(kind)
        cells["NumberOfCells"] = cells["NumberOfConnectivityIds"] = np.full(steps, count)
        cells["Offsets"] = np.tile(np.arange(count + 1), steps)
        cells["Connectivity"] = np.tile(np.arange(count), steps)
    time = root.create_group("Steps")
    time.attrs["NSteps"] = steps
    time["Values"] = np.arange(steps, dtype="f8")
    time["PartOffsets"] = np.arange(steps)
    time["NumberOfParts"] = np.ones(steps, "i8")
    time["PointOffsets"] = np.arange(steps) * points
    offsets = np.zeros((steps, 4), "i8")
    offsets[:, 0] = np.arange(steps) * points
    time["CellOffsets"] = time["ConnectivityIdOffsets"] = offsets
    time.create_group("PointDataOffsets")["a"] = np.arange(steps) * points


def last_of(requests, cached):
    reader = vtk.vtkHDFReader()
    reader.SetFileName(path)
    reader.SetUseCache(cached)
    reader.UpdateInformation()
    for step in requests:
        reader.UpdateTimeStep(float(step))
        shown = reader.GetOutputDataObject(0)
        x = vtk_to_numpy(shown.GetPoints().GetData())[:, 0].astype(int).tolist()
        a = vtk_to_numpy(shown.GetPointData().GetArray("a")).astype(int).tolist()
    print(f"cache {'on' if cached else 'off'}, steps {requests}: x = {x}, a = {a}")
    return x, a


first, second = [0, 1, 2, 3], [4, 5, 6, 7]
requests = [0, 1, 2, 1, 0]
print("VTK", vtk.vtkVersion().GetVTKVersion())
plain, cached = last_of(requests, False), last_of(requests, True)
sys.exit(0 if plain == (first, first) and cached == (second, first) else 1)
PYTHON
"$work/venv/bin/python" "$work/show.py" "$work/steps.vtkhdf" || {
  echo "no longer as described" >&2
  exit 1
}
echo "as described"
