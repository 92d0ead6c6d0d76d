#!/usr/bin/env bash
# Taichi and Warp: the largest value of an array with NaN; what is found depends on where the NaN stands.
#
# Seen with   taichi 1.7.4 (arch=cpu, one thread), warp-lang 1.19.0 (device "cpu"), numpy 2.4.6.
# Behavior    Taichi's ti.atomic_max stores NaN when the NaN comes and lets the next number overwrite it: NaN is
#             seen only if it stands last. ti.max(nan, 1) is 1 in both orders of its arguments.
#             In Taichi `x != x` is false for NaN, with fast_math (the default) and without: the comparison is
#             an ordered one. ti.math.isnan(x) and `not (x <= 1)` are true, in both modes.
#             Warp's wp.atomic_max never stores NaN: [nan] leaves the initial 0, a fluid at rest.
# Output seen atomic_max from 0 over [1 nan 3], [3 nan], [nan 3]: Taichi 3, nan, 3; Warp 3, 3, 3.
# Why         The largest speed feeds the time step and the watchdog. A diverged particle makes neither loud: the
#             step stays as it was, or is chosen for a fluid at rest. Count non-finite values with isnan on their
#             own, never with `x != x` or by the maximum.
set -euo pipefail
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --no-compile --disable-pip-version-check --only-binary=:all: \
    taichi==1.7.4 warp-lang==1.19.0 numpy==2.4.6
cd "$dir"
cat >with_taichi.py <<'PY'
import sys

import numpy as np
import taichi as ti

options = {} if sys.argv[1] == "fast" else {"fast_math": False}
ti.init(arch=ti.cpu, cpu_max_num_threads=1, offline_cache=False, log_level=ti.ERROR, **options)


@ti.kernel
def largest(x: ti.types.ndarray(), out: ti.types.ndarray()):
    for i in x:
        ti.atomic_max(out[0], x[i])


@ti.kernel
def tests(x: ti.types.ndarray(), out: ti.types.ndarray()):
    for i in x:
        out[0] = ti.max(x[i], 1.0)
        out[1] = ti.max(1.0, x[i])
        out[2] = float(x[i] != x[i])
        out[3] = float(ti.math.isnan(x[i]))
        out[4] = float(not (x[i] <= 1.0))


nan, found = np.nan, []
for values in ([1, nan, 3], [3, nan], [nan, 3]):
    out = np.zeros(1, "f4")
    largest(np.array(values, "f4"), out)
    found.append(float(out[0]))
out = np.zeros(5, "f4")
tests(np.array([nan], "f4"), out)
print("Taichi", sys.argv[1], "atomic_max", found, "max, max, x != x, isnan, not <=:", out.tolist())
assert found[0] == 3 and np.isnan(found[1]) and found[2] == 3
assert out.tolist() == [1, 1, 0, 1, 1]
PY
cat >with_warp.py <<'PY'
import numpy as np
import warp as wp

wp.config.quiet = True
wp.init()


@wp.kernel
def largest(x: wp.array(dtype=float), out: wp.array(dtype=float)):
    wp.atomic_max(out, 0, x[wp.tid()])


nan, found = np.nan, []
for values in ([1, nan, 3], [3, nan], [nan, 3], [nan]):
    out = wp.zeros(1, dtype=float, device="cpu")
    wp.launch(largest, len(values), inputs=[wp.array(np.array(values, "f4"), device="cpu"), out], device="cpu")
    found.append(float(out.numpy()[0]))
print("Warp atomic_max", found)
assert found == [3, 3, 3, 0]
PY
export HOME="$dir" WARP_CACHE_PATH="$dir/cache"
"$dir/venv/bin/python" with_taichi.py fast
"$dir/venv/bin/python" with_taichi.py strict
"$dir/venv/bin/python" with_warp.py
