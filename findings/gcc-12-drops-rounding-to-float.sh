#!/usr/bin/env bash
# GCC 12.2: two neighboring doubles converted to float and back keep all their bits at -O2; nothing is rounded.
#
# Seen with   cpp-12 12.2.0-14+deb12u1 (Debian 12, x86-64), its C compiler proper. g++ 12.2.0 does the same.
# Behavior    b[0] = (double)(float)a[0]; b[1] = (double)(float)a[1]; compiles to one 16-byte copy: the vectorizer of
#             straight-line code (on since -O2 in GCC 12) folds the pair of conversions away, though neither
#             -ffast-math nor anything like it is given. With -fno-tree-slp-vectorize, with one value, or at -O1, each
#             value is rounded. Loops are right, and so are vectors of four; Eigen's Vector2d and Vector3d are not
#             (v.cast<float>().cast<double>(), the first two components at -O3). g++ 14.2 (Debian 13) rounds.
# Output seen no conversion instruction in the pair, two in the same code without the vectorizer.
# Why         0.1 stays 0.1 instead of 0.10000000149011612: code that rounds its input to single precision, so that a
#             double reference and a float port start from the same numbers, compares two different problems, and
#             differences of 1e-8 look like the port's error. Round in a loop, or switch the vectorizer off.
set -euo pipefail
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT
chmod 755 "$dir"
cd "$dir"
apt-get download -qq cpp-12=12.2.0-14+deb12u1 libisl23 libmpc3 libmpfr6 libgmp10 >/dev/null 2>&1
for package in *.deb; do dpkg -x "$package" root; done
export LD_LIBRARY_PATH="$dir/root/usr/lib/x86_64-linux-gnu"
compiler=root/usr/lib/gcc/x86_64-linux-gnu/12/cc1

cat >pair.c <<'C'
void rounded(const double* a, double* b) {
  const double x = (float)a[0], y = (float)a[1];
  b[0] = x;
  b[1] = y;
}
C
cat >one.c <<'C'
void rounded(const double* a, double* b) { b[0] = (float)a[0]; }
C
conversions() {  # FILE OPTION…: instructions that convert a double to a float
  "$compiler" -quiet "${@:2}" -o "$1.s" "$1"
  grep -c 'cvtsd2ss\|cvtpd2ps' "$1.s" || true
}

version=$("$compiler" -quiet -version -o version.s one.c 2>&1)
version=${version%%$'\n'*}
echo "$version"
[[ $version == *"version 12.2.0"* ]]
echo "a pair at -O2: $(conversions pair.c -O2) conversions"
echo "a pair at -O2 -fno-tree-slp-vectorize: $(conversions pair.c -O2 -fno-tree-slp-vectorize)"
[[ $(conversions pair.c -O2) == 0 ]]
grep -q 'movup[sd]' pair.c.s
[[ $(conversions pair.c -O2 -fno-tree-slp-vectorize) == 2 ]]
[[ $(conversions pair.c -O1) == 2 ]]
[[ $(conversions one.c -O2) == 1 ]]
echo "as before"
