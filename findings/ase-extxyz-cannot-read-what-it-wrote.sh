#!/usr/bin/env bash
# ASE extended XYZ: small lengths become 0, and ids beyond 31 bits are written but not read back.
#
# Seen with   ase 3.29.0, numpy 2.4.6.
# Behavior    The writer prints every real as fixed point with 8 decimals whatever its size, and says nothing. A
#             position of 4e-9 comes back as 0; 1.2345678901234 comes back as 1.23456789. An int64 array is
#             written in full; the reader makes int32 of it and raises OverflowError for ids from 2^31 on.
# Output seen as asserted below.
# Why         Fluids in metres (droplets, films, particle masses of 1e-10 kg) lose digits or all of their mass,
#             while the same files in Angstrom look fine. Ids that hold a rank or body in their high bits make
#             a file that the tool which wrote it cannot open. Scale to the particle spacing before writing.
set -euo pipefail
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --no-compile --disable-pip-version-check --only-binary=:all: \
    --no-deps ase==3.29.0 numpy==2.4.6 scipy==1.17.1
cd "$dir"
"$dir/venv/bin/python" -W ignore - <<'PY'
import ase
import ase.io
import numpy as np


def back(first_id):
    atoms = ase.Atoms("H2", positions=[[4e-9, 1.2345678901234, 0], [1, 1, 1]])
    atoms.arrays["particle_mass"] = np.array([1e-10, 1000.0])
    atoms.arrays["particle_id"] = np.array([first_id, 1], dtype=np.int64)
    ase.io.write("x.xyz", atoms, format="extxyz")
    return ase.io.read("x.xyz", format="extxyz")


got = back(2**31 - 1)
print(got.positions[0], got.arrays["particle_mass"], got.arrays["particle_id"], got.arrays["particle_id"].dtype)
assert got.positions[0].tolist() == [0.0, 1.23456789, 0.0]
assert got.arrays["particle_mass"].tolist() == [0.0, 1000.0]
assert got.arrays["particle_id"].dtype == np.int32
try:
    back(2**31)
except OverflowError as error:
    print("OverflowError:", error)
else:
    raise SystemExit("ids of 2^31 can be read")
assert str(2**31) in open("x.xyz").read()
PY
