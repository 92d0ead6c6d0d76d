#!/usr/bin/env bash
# h5diff: with a tolerance it finds no difference between infinity and 1, nor between the extreme int32 values.
#
# Seen with   hdf5-tools 1.10.8+repack1-1 (Debian 12), h5py 3.16.0, numpy 2.4.6.
# Behavior    Exit 0 ("no differences") and no output when
#             - with -p, the first file's value is infinite and the second's is 1: |a - b| / |a| is inf / inf,
#               and NaN is not above the limit. With the files swapped the difference is found.
#             - with -d 5, int32 values are -2147483648 and 2147483647: their difference overflows. 0 and
#               2147483647 are found to differ.
#             On the other hand 0.0 and -0.0 differ, exit 1, though no arithmetic tells them apart. (Known:
#             values of unlike shape or type are "not comparable", one line of text and exit 0.)
# Output seen exit codes as asserted below.
# Why         "h5diff -p 1e-6 oracle.h5 port.h5 && echo same" passes an oracle that overflowed against any port,
#             and fails a port whose velocities at rest have the other zero. Compare shapes, types and finiteness
#             first, and run it with the files in both orders.
set -euo pipefail
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT
chmod 755 "$dir"
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --no-compile --disable-pip-version-check --only-binary=:all: \
    h5py==3.16.0 numpy==2.4.6
cd "$dir"
apt-get download -qq hdf5-tools libhdf5-103-1 libhdf5-hl-100 libsz2 libaec0 >/dev/null 2>&1
for package in *.deb; do dpkg -x "$package" root; done
export LD_LIBRARY_PATH="$dir/root/usr/lib/x86_64-linux-gnu" PATH="$dir/root/usr/bin:$PATH"
h5diff --version
"$dir/venv/bin/python" - <<'PY'
import subprocess

import h5py
import numpy as np


def code(a, b, *options):
    for name, values in (("a.h5", a), ("b.h5", b)):
        with h5py.File(name, "w") as file:
            file["x"] = values
    # The wheel brings its own HDF5; h5diff runs in its own process with Debian's.
    return subprocess.run(["h5diff", *options, "a.h5", "b.h5"], stdout=subprocess.DEVNULL).returncode


f, low, high = np.float64, -(2**31), 2**31 - 1
seen = {
    "3 values, 4 values": code(np.arange(3.0), np.arange(4.0)),
    "float64, int32": code(np.arange(3.0), np.arange(3, dtype=np.int32)),
    "-p: inf, 1": code(f([np.inf]), f([1.0]), "-p", "1e-6"),
    "-p: 1, inf": code(f([1.0]), f([np.inf]), "-p", "1e-6"),
    "-d 5: least, largest int32": code(np.int32([low]), np.int32([high]), "-d", "5"),
    "-d 5: 0, largest int32": code(np.int32([0]), np.int32([high]), "-d", "5"),
    "0.0, -0.0": code(f([0.0]), f([-0.0])),
    "nan, 1": code(f([np.nan]), f([1.0])),
}
for case, exit_code in seen.items():
    print(f"{exit_code}  {case}")
assert list(seen.values()) == [0, 0, 0, 1, 0, 1, 1, 1]
PY
