#!/usr/bin/env bash
# Pairs exactly at the cutoff: libraries disagree, and MDAnalysis disagrees with itself by particle count.
#
# Seen with   MDAnalysis 2.11.0, scipy 1.17.1, ase 3.29.0, vesin 0.6.2, freud-analysis 3.4.0,
#             pynanoflann 0.10.0, numpy 2.4.6.
# Behavior    scipy's cKDTree keeps a pair at r = cutoff; ase, vesin, freud and pynanoflann (whose methods are
#             named as scikit-learn's, which keeps it) drop it.
#             MDAnalysis' self_capped_distance promises the interval (min, max]. In a periodic box its
#             "bruteforce" method drops most of such pairs and keeps some, its "nsgrid" and "pkdtree" methods
#             keep all. The method is chosen from the number of particles unless named.
# Output seen cubic lattice in a periodic box of 10, spacing = cutoff, all coordinates exact in binary:
#             64 particles 2.5 apart: 48 of 192 pairs by default and by brute force, 192 by grid and tree;
#             125 particles 2.0 apart: 375 of 375 by default, 75 by brute force.
#             A pair 2.0 apart in a box of 10 that no boundary separates: brute force drops it at cutoff 2.
# Why         Particles start on lattices whose spacing divides the support, so that whole shells sit at the
#             cutoff. The kernel is zero there, but neighbor counts, list capacities, smoothing lengths set
#             by counts and surface detectors are not. Compare sets of pairs without the shell.
set -euo pipefail
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --no-compile --disable-pip-version-check --only-binary=:all: \
    MDAnalysis==2.11.0 scipy==1.17.1 ase==3.29.0 vesin==0.6.2 freud-analysis==3.4.0 pynanoflann==0.10.0 \
    numpy==2.4.6
cd "$dir"
"$dir/venv/bin/python" -W ignore - <<'PY'
import ase
import ase.neighborlist
import freud
import numpy as np
import pynanoflann
import vesin
from MDAnalysis.lib.distances import self_capped_distance
from scipy.spatial import cKDTree

side, cutoff = 10.0, 2.0
x = np.array([[1.0, 1, 1], [3.0, 1, 1]])
atoms = ase.Atoms("H2", positions=x, cell=[side] * 3, pbc=True)
box = freud.box.Box.cube(side)
flann = pynanoflann.KDTree(metric="L2", radius=cutoff)
flann.fit(x)
mda_box = np.array([side] * 3 + [90] * 3, dtype="f4")
keeps = {
    "scipy cKDTree": len(cKDTree(x, boxsize=side).query_pairs(cutoff)),
    "ase": len(ase.neighborlist.neighbor_list("i", atoms, cutoff)) // 2,
    "vesin": len(vesin.NeighborList(cutoff=cutoff, full_list=True).compute(
        points=x, box=np.eye(3) * side, periodic=True, quantities="i")[0]) // 2,
    "freud": len(freud.locality.AABBQuery(box, x - side / 2).query(
        x - side / 2, dict(mode="ball", r_max=cutoff, exclude_ii=True)).toNeighborList()[:]) // 2,
    "pynanoflann": len(flann.radius_neighbors(x[:1])[1][0]) - 1,
}
for method in ("bruteforce", "nsgrid", "pkdtree"):
    keeps["MDAnalysis " + method] = len(self_capped_distance(
        x.astype("f4"), cutoff, box=mda_box, method=method, return_distances=False))
print("a pair at the cutoff is kept by", keeps)
assert keeps == {"scipy cKDTree": 1, "ase": 0, "vesin": 0, "freud": 0, "pynanoflann": 0,
                 "MDAnalysis bruteforce": 0, "MDAnalysis nsgrid": 1, "MDAnalysis pkdtree": 1}

for n, by_default, by_brute in ((4, 48, 48), (5, 375, 75)):
    dx = side / n
    lattice = np.stack(np.meshgrid(*[np.arange(n) * dx] * 3, indexing="ij"), -1).reshape(-1, 3).astype("f4")
    got = {m: len(self_capped_distance(lattice, dx, box=mda_box, method=m, return_distances=False))
           for m in ("bruteforce", "nsgrid", "pkdtree", None)}
    print(f"{n**3} particles, {3 * n**3} pairs at the cutoff: MDAnalysis", got)
    assert got == {"bruteforce": by_brute, "nsgrid": 3 * n**3, "pkdtree": 3 * n**3, None: by_default}
PY
