#!/usr/bin/env bash
# VTK's SPH interpolator: asking for the derivative of one array changes the values of all, and it is no derivative.
#
# Seen with   vtk 9.6.2, numpy 2.1.3; 9.3.1, 9.5.2 and 9.7.2 alike.
# Behavior    vtkSPHInterpolator takes m / rho as a particle's volume once it is told the names of the mass and the
#             density array. After AddDerivativeArray("p") it takes h^3 instead (h the kernel's SpatialStep), without
#             a word, for p_deriv, for every other array and for the Shepard sum. With ShepardNormalization
#             the factor cancels in the values, so that nothing is seen.
#             p_deriv is sum h^3 p_j W'(q_j) / h^3: W' by q = r / h, neither divided by h nor times the direction
#             to the particle. It measures no slope: inside the fluid it is the value of p times a negative constant.
#             The documentation promises volumes by mass and density, and "a SPH derivative formulation".
# Output seen 8000 particles of spacing 0.1 on a lattice, h = 0.13, cubic spline, p = 3 + 2 x, c = 1, m / rho = 0.001;
#             sampled in the middle, at x = 0.05:
#                            c      p      Shepard sum
#             no derivative  0.9973 3.0915 0.9973
#             p_deriv too    2.1910 6.7921 2.1910
#             p_deriv for slope +2: -18.384, for slope -2: -17.198; c_deriv -5.930
#             (2, -2 and 0 would be right)
#             All but the Shepard sum (a float) agree with the sums above, by brute force, to 1e-12.
# Why         As reference for a port's interpolation or gradient it fails a right one: values off by h^3 rho / m
#             (2.2 here, 1 for h = dx, where a test that takes h = dx sees nothing), only while a derivative is shown.
set -euo pipefail
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --no-compile --disable-pip-version-check --only-binary=:all: \
    vtk==9.6.2 numpy==2.1.3
"$dir/venv/bin/python" - <<'PY'
import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

dx, h, side = 0.1, 0.13, 20
axis = (np.arange(side) + 0.5 - side / 2) * dx
x = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3)
sample = np.array([[0.05, 0.05, 0.05], [0.31, 0.02, -0.17], [-0.4, 0.2, 0.1]])


def points(coordinates):
    data = vtk.vtkPolyData()
    data.SetPoints(vtk.vtkPoints())
    data.GetPoints().SetData(numpy_to_vtk(coordinates, deep=True))
    return data


def interpolate(arrays, derivatives=()):
    source, kernel, sph = points(x), vtk.vtkSPHCubicKernel(), vtk.vtkSPHInterpolator()
    for name, values in arrays.items():
        array = numpy_to_vtk(values, deep=True)
        array.SetName(name)
        source.GetPointData().AddArray(array)
    kernel.SetDimension(3)
    kernel.SetSpatialStep(h)
    sph.SetInputData(points(sample))
    sph.SetSourceData(source)
    sph.SetKernel(kernel)
    sph.SetMassArrayName("m")
    sph.SetDensityArrayName("rho")
    for name in derivatives:
        sph.AddDerivativeArray(name)
    sph.Update()
    out = sph.GetOutput().GetPointData()
    return {out.GetArrayName(i): vtk_to_numpy(out.GetArray(i)).copy() for i in range(out.GetNumberOfArrays())}


def fields(slope):
    one = np.ones(len(x))
    return {"c": one, "p": 3 + slope * x[:, 0], "m": 1000 * dx**3 * one, "rho": 1000 * one}


# The same sums by brute force: the cubic spline and its derivative by q, without the division by h^3.
q = np.linalg.norm(sample[:, None] - x[None], axis=2) / h
near, far = np.maximum(1 - q, 0), np.maximum(2 - q, 0)
w, dw = (far**3 / 4 - near**3) / np.pi, (3 * near**2 - 3 * far**2 / 4) / np.pi
up, down = fields(2.0), fields(-2.0)
plain, asked = interpolate(up), interpolate(up, ["p", "c"])
print("VTK", vtk.vtkVersion.GetVTKVersion())
for title, got, volume in (("no derivative", plain, dx**3 / h**3), ("p_deriv too", asked, 1.0)):
    print(f"{title:14}", *(f"{got[name][0]:.4f}" for name in ("c", "p", "Shepard Summation")))
    for name in ("c", "p"):
        assert np.allclose(got[name], volume * (w @ up[name]), rtol=1e-12, atol=0)
    assert np.allclose(got["Shepard Summation"], volume * w.sum(1), rtol=1e-6)
mirrored = interpolate(down, ["p"])
print(f"p_deriv for slope +2: {asked['p_deriv'][0]:.3f}, for slope -2: {mirrored['p_deriv'][0]:.3f};"
      f" c_deriv {asked['c_deriv'][0]:.3f}")
for got, name, values in ((asked, "p", up["p"]), (asked, "c", up["c"]), (mirrored, "p", down["p"])):
    assert np.allclose(got[name + "_deriv"][: len(sample)], dw @ values, rtol=1e-12, atol=0)
PY
