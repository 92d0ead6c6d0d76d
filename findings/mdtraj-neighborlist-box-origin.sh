#!/usr/bin/env bash
# MDTraj: the neighbor list loses pairs of a periodic box that does not start at 0; how many depends on the order.
#
# Seen with   mdtraj 1.11.1.post2, numpy 2.4.6; 1.10.3 and 1.11.0 alike.
# Behavior    compute_neighborlist of a periodic trajectory is right when all coordinates are in [0, L]. In a box
#             from -L/2 to L/2 it drops pairs that meet across the boundary, in both particles' lists, and says
#             nothing. Turning the order of the particles around gives another number of pairs.
#             compute_neighbors finds all pairs of the same trajectory. Neither the docstring nor a warning asks for
#             wrapped coordinates, and the LAMMPS dump reader keeps the origin that the dump has.
# Output seen 512 particles on a lattice of spacing 1.25 in a box of 10, cutoff 2, 18 neighbors each, 4608 pairs:
#             box from 0: 4608, 18 for every particle; box from -5: 4256, 6 to 18; reversed order: 4283, 11 to 18.
#             The closest pair lost is 1.25 apart. Through a LAMMPS dump with bounds -50 to 50: 4256.
# Why         LAMMPS and HOOMD boxes are often centered, and particles that left a periodic box are often not
#             wrapped. As reference for a port's neighbor search this list blames the port, and particles at the
#             faces look like a free surface. Wrap into [0, L) first; lists that are symmetric prove nothing.
set -euo pipefail
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --no-compile --disable-pip-version-check --only-binary=:all: \
    mdtraj==1.11.1.post2 numpy==2.4.6
cd "$dir"
"$dir/venv/bin/python" -W ignore - <<'PY'
import mdtraj
import numpy as np

side, cutoff, n = 10.0, 2.0, 8
lattice = (np.stack(np.meshgrid(*[np.arange(n) + 0.5] * 3, indexing="ij"), -1).reshape(-1, 3)) * (side / n)
topology = mdtraj.Topology()
residue = topology.add_residue("P", topology.add_chain())
for _ in lattice:
    topology.add_atom("P", mdtraj.element.argon, residue)


def trajectory(x):
    return mdtraj.Trajectory(x[None].astype("f4"), topology, unitcell_lengths=[[side] * 3],
                             unitcell_angles=[[90] * 3])


def dump(x):
    with open("dump.lammpstrj", "w") as file:
        file.write(f"ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n{len(x)}\nITEM: BOX BOUNDS pp pp pp\n"
                   "-50 50\n-50 50\n-50 50\nITEM: ATOMS id type x y z\n")
        for i, p in enumerate(10 * x):  # angstrom in the file, nanometers in MDTraj
            file.write(f"{i + 1} 1 {p[0]} {p[1]} {p[2]}\n")
    return mdtraj.load_lammpstrj("dump.lammpstrj", top=topology)


def found(lists):
    matrix = np.zeros((len(lattice),) * 2, bool)
    for i, row in enumerate(lists):
        matrix[i, row] = True
    np.fill_diagonal(matrix, False)
    return matrix


def count(name, t):
    d = t.xyz[0].astype("f8")
    d = d[:, None] - d[None]
    d -= side * np.round(d / side)
    r = np.sqrt((d**2).sum(-1))
    true = (r < cutoff) & ~np.eye(len(r), dtype=bool)
    fast = found(mdtraj.compute_neighborlist(t, cutoff))
    slow = found([mdtraj.compute_neighbors(t, cutoff, np.array([i]))[0] for i in range(len(r))])
    assert (slow == true).all() and (true.sum(1) == 18).all()
    assert (fast == fast.T).all() and not (fast & ~true).any()
    per_particle = fast.sum(1)
    closest = r[true & ~fast].min(initial=np.inf)
    print(f"{name}: {fast.sum() // 2} of {true.sum() // 2} pairs, {per_particle.min()} to {per_particle.max()} "
          f"neighbors each, closest lost {closest:.4f}")
    return int(fast.sum() // 2), int(per_particle.min()), int(per_particle.max())


print("mdtraj", mdtraj.__version__, "numpy", np.__version__)
assert count("box from 0 to 10", trajectory(lattice)) == (4608, 18, 18)
assert count("box from -5 to 5", trajectory(lattice - 5)) == (4256, 6, 18)
assert count("the same, order reversed", trajectory(lattice[::-1] - 5)) == (4283, 11, 18)
assert count("box from -5 to 5 through a LAMMPS dump", dump(lattice - 5)) == (4256, 6, 18)
PY
