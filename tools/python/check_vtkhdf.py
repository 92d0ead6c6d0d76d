#!/usr/bin/env python3
"""Reads a pour's frames.vtkhdf and walls.vtkhdf with VTK, step by step, and compares every value with
frames.h5, bit for bit.

    python3 -m venv vtk && vtk/bin/pip install vtk==9.5.2 h5py
    vtk/bin/python tools/python/check_vtkhdf.py build/pour-4k

Exit status 1 where something differs.
"""
import argparse
import os
import sys

import h5py
import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkVersion
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
from vtkmodules.vtkIOHDF import vtkHDFReader


def steps_of(file, times):
    """VTK's output at every step."""
    reader = vtkHDFReader()
    reader.SetFileName(file)
    reader.UpdateInformation()
    found = reader.GetOutputInformation(0).Get(vtkStreamingDemandDrivenPipeline.TIME_STEPS())
    if found is None or list(found) != list(times):
        sys.exit(f"check_vtkhdf: {file}: other times than frames.h5")
    for time in times:
        reader.UpdateTimeStep(time)
        yield reader.GetOutputDataObject(0)


def same(array, expected):
    """Whether a VTK array has the type and the bytes of another."""
    found = vtk_to_numpy(array)
    return (found.dtype, found.shape, found.tobytes()) == (expected.dtype, expected.shape, expected.tobytes())


def fluid_differs(points, fluid, step):
    """Names of what differs."""
    if points.GetNumberOfPoints() == fluid["place"].shape[1] == 0:
        return []
    data = points.GetPointData()
    arrays = {name: data.GetArray(name) for name in ("velocity", "density", "pressure", "place")}
    arrays["position"] = points.GetPoints().GetData()
    differing = [name for name, array in arrays.items() if not same(array, fluid[name][step])]
    return differing + ([] if points.GetNumberOfVerts() == fluid["place"].shape[1] else ["vertices"])


def wall_differs(surface, wall, step):
    """Names of what differs."""
    moving = wall["vertex"].ndim == 3
    differing = [] if same(surface.GetPoints().GetData(), wall["vertex"][step if moving else ...]) else ["vertex"]
    triangle = vtk_to_numpy(surface.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    return differing + ([] if np.array_equal(triangle, wall["triangle"]) else ["triangle"])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", help="the pour's --out")
    folder = parser.parse_args().folder
    complaints = []
    with h5py.File(os.path.join(folder, "frames.h5")) as frames:
        times = frames["time"][:]
        for step, points in enumerate(steps_of(os.path.join(folder, "frames.vtkhdf"), times)):
            complaints += [f"step {step}: {name}" for name in fluid_differs(points, frames["fluid"], step)]
        # Without walls there is nothing that has times.
        walls = frames.get("walls", {})
        for step, surfaces in enumerate(steps_of(os.path.join(folder, "walls.vtkhdf"), times) if walls else []):
            tree = surfaces.GetDataAssembly()
            for name, wall in walls.items():
                index, = tree.GetDataSetIndices(tree.FindFirstNodeWithName("wall_" + name))
                surface = surfaces.GetPartition(index, 0)
                complaints += [f"step {step}: {name}: {what}" for what in wall_differs(surface, wall, step)]
        print(f"VTK {vtkVersion.GetVTKVersion()}: {len(times)} steps, {len(walls)} walls")
    for complaint in complaints:
        print("check_vtkhdf: differs: " + complaint, file=sys.stderr)
    return 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main())
