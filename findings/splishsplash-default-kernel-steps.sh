#!/usr/bin/env bash
# SPlisHSPlasH: the kernel it uses by default is a step function, and near r = 0 its gradient has half its value.
#
# Seen with   pysplishsplash 2.19.0, numpy 2.4.6.
# Behavior    Unless a scene says otherwise, kernel and gradient are the "precomputed cubic" ones: the nearest of
#             10,000 entries over the support, without interpolation. W is constant over 1/10,000 of the support
#             and then jumps; within half a step of r = 0 the gradient has 0.5 times its value (the spiky kernel's
#             0.05 to 1.5 times within two steps); at r = support radius W is not 0. The kernels that are computed
#             agree with their formulas to the rounding of fp32.
# Output seen default: kernel 4, gradient 4; the precomputed cubic one is 4.
#             support 0.1, 200 distances between 0.0500 and 0.0501: 11 values of W, computed 200;
#             largest error 7.9e-05 of W(0), computed 2.1e-07;
#             gradient at 1e-5 of the support: 0.500 of the computed one; W(support) = 2.5e-09.
# Why         Two codes then agree to 1e-4 at best, hundreds of times what fp32 explains, and a difference quotient
#             of W is 0 or a whole jump. Compare with kernel 0, the computed cubic spline.
set -euo pipefail
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --no-compile --disable-pip-version-check --only-binary=:all: \
    pysplishsplash==2.19.0 numpy==2.4.6
cd "$dir"
cat >scene.json <<'JSON'
{"Configuration": {"particleRadius": 0.025},
 "FluidBlocks": [{"denseMode": 0, "start": [0, 0, 0], "end": [0.2, 0.2, 0.2]}]}
JSON
cat >look.py <<'PY'
import os

import numpy as np
import pysplishsplash as sph

base = sph.Exec.SimulatorBase()
base.init(useGui=False, sceneFile=os.path.abspath("scene.json"), outputDir=os.path.abspath("out"))
base.initSimulation()
simulation, table = sph.Simulation.getCurrent(), sph.Simulation.ENUM_KERNEL_PRECOMPUTED_CUBIC
kernel, gradient = simulation.getKernel(), simulation.getGradKernel()
print(f"default: kernel {kernel}, gradient {gradient}; the precomputed cubic one is {table}")
assert kernel == gradient == table == 4

R = 0.1
stored, computed = sph.SPHKernels.Precomputed.CubicKernel, sph.SPHKernels.CubicKernel
q = np.linspace(0, 1, 20001)
exact = 8 / np.pi / R**3 * np.where(q < 0.5, 6 * q**3 - 6 * q**2 + 1, 2 * (1 - q)**3)
for name, kernel, steps in (("stored", stored, 11), ("computed", computed, 200)):
    kernel.setRadius(R)
    values = len({kernel.W(float(r)) for r in np.linspace(0.05, 0.0501, 200)})
    off = max(abs(kernel.W(float(r)) - w) for r, w in zip(q * R, exact)) / exact[0]
    print(f"{name}: {values} values of W between r = 0.0500 and 0.0501, largest error {off:.1e} of W(0)")
    assert values == steps and (off > 5e-5) == (kernel is stored)
near = np.array([1e-5 * R, 0, 0], np.float32)
share = stored.gradW(near)[0] / computed.gradW(near)[0]
print(f"gradient at r = 1e-5 of the support: {share:.3f} of the computed one; W(support) = {stored.W(R):.1e}")
assert abs(share - 0.5) < 0.01 and stored.W(R) > 0
PY
# The package's own libGLdispatch and a libGLX of the system do not go together: the system's for both, if there.
preload=$(ldconfig -p 2>/dev/null | awk '$1 == "libGLdispatch.so.0" {print $1; exit}')
LD_PRELOAD=$preload "$dir/venv/bin/python" look.py 2>/dev/null
