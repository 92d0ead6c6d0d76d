#!/usr/bin/env bash
# PySPH: with unequal smoothing lengths one of twelve neighbor searches loses pairs, and only one way.
#
# Seen with   python3-pysph 1.0~b1-5+b1 (Debian 12, Python 3.11), python3-compyle 0.8.1-4.
# Behavior    The searches of pysph.base.nnps return j for i when r_ij < k max(h_i, h_j).
#             ExtendedZOrderNNPS with its default of H = 3 sub-cells per cell does so for equal h but not for
#             unequal ones; nothing is raised. With H = 1 it agrees with brute force.
# Output seen 400 particles at random in the unit cube, h between 0.03 and 0.15 (k = 2): of 6448 ordered
#             pairs 60 are missing, each of them in one direction only (i sees j, j does not see i);
#             ZOrderNNPS, LinkedListNNPS and OctreeNNPS miss none.
# Why         Pair forces of a lost direction break Newton's third law: momentum drifts by far more than
#             rounding. A port checked against this search with one h for all passes.
set -euo pipefail
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT
chmod 755 "$dir"; cd "$dir"
apt-get download -qq python3-pysph python3-compyle python3-cyarray python3-pytools python3-mako python3-markupsafe \
    cython3 python3-numpy libblas3 liblapack3 libgfortran5 >/dev/null 2>&1
for package in *.deb; do dpkg -x "$package" root; done
lib="$dir/root/usr/lib/x86_64-linux-gnu"
export LD_LIBRARY_PATH="$lib:$lib/blas:$lib/lapack" OMP_NUM_THREADS=1 HOME="$dir"
export PYTHONPATH="$dir/root/usr/lib/python3/dist-packages"
/usr/bin/python3 - <<'PY'
import numpy as np
from cyarray.api import UIntArray
from pysph.base import nnps
from pysph.base.utils import get_particle_array


def pairs(search, x, h, **options):
    fluid = get_particle_array(name="fluid", x=x[0], y=x[1], z=x[2], h=h)
    found = getattr(nnps, search)(dim=3, particles=[fluid], radius_scale=2.0, **options)
    found.update()
    found.set_context(0, 0)
    near, out = UIntArray(), set()
    for i in range(len(h)):
        found.get_nearest_particles(0, 0, i, near)
        out |= {(i, int(j)) for j in near.get_npy_array()}
    return out


rng = np.random.default_rng(0)
x = rng.random((3, 400))
unequal = 0.03 + 0.12 * np.random.default_rng(1).random(400)
r = np.linalg.norm(x[:, :, None] - x[:, None], axis=0)
for h, label in ((np.full(400, 0.08), "equal h"), (unequal, "unequal h")):
    right = {tuple(p) for p in np.argwhere(r < 2 * np.maximum(h[:, None], h[None]))}
    for search, options in (("LinkedListNNPS", {}), ("ZOrderNNPS", {}), ("OctreeNNPS", {}),
                            ("ExtendedZOrderNNPS", {"H": 1}), ("ExtendedZOrderNNPS", {})):
        got = pairs(search, x, h, **options)
        one_way = sum((j, i) not in got for i, j in got)
        print(f"{label}: {search} {options or ''}: {len(right)} pairs, {len(right - got)} missing, "
              f"{len(got - right)} extra, {one_way} one-way")
        assert not got - right
        if search == "ExtendedZOrderNNPS" and not options and label == "unequal h":
            assert len(right - got) > 20 and one_way == len(right - got)
        else:
            assert got == right
PY
