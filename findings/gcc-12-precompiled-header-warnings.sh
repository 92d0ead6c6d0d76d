#!/usr/bin/env bash
# GCC 12.2: a precompiled header brings warnings about <string> that the same source does not get without one.
#
# Seen with   g++-12 12.2.0-14+deb12u1 (Debian 12, x86-64), its C++ compiler proper, -std=c++20 -O3 -Wall -Wno-restrict.
# Behavior    s += "\n" + std::string(n, ' '); is compiled twice, with <string> from a header that is included and from
#             the same header precompiled. Only the second is told -Wstringop-overflow, in bits/char_traits.h, of a copy
#             whose length "exceeds maximum object size": a false alarm of the kind of GCC bug 105651, in a system
#             header, where warnings are otherwise silent. With -std=c++17 neither is.
# Output seen 1 warning with the precompiled header, none without.
# Why         a project that makes warnings errors and then precompiles headers to build faster fails in sources that
#             nobody touched.
set -euo pipefail
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT
chmod 755 "$dir"
cd "$dir"
apt-get download -qq g++-12=12.2.0-14+deb12u1 libstdc++-12-dev=12.2.0-14+deb12u1 libgcc-12-dev=12.2.0-14+deb12u1 \
  libc6-dev linux-libc-dev libisl23 libmpc3 libmpfr6 libgmp10 >/dev/null 2>&1
for package in *.deb; do dpkg -x "$package" root; done
export LD_LIBRARY_PATH="$dir/root/usr/lib/x86_64-linux-gnu"
root=root/usr
compile() {  # STANDARD ARGUMENT…
  $root/lib/gcc/x86_64-linux-gnu/12/cc1plus -quiet -nostdinc -D_GNU_SOURCE \
    -isystem $root/include/c++/12 -isystem $root/include/x86_64-linux-gnu/c++/12 \
    -isystem $root/lib/gcc/x86_64-linux-gnu/12/include -isystem $root/include/x86_64-linux-gnu \
    -isystem $root/include -O3 -Wall -Wno-restrict "-std=c++$1" "${@:2}" 2>&1
}

echo '#include <string>' >plain.hpp
cp plain.hpp precompiled.hpp
cat >line.cpp <<'C'
#include <string>
std::string line(int n) {
  std::string s;
  s += "\n" + std::string(n, ' ');
  return s;
}
C
warnings() {  # STANDARD HEADER
  compile "$1" -include "$2" line.cpp -o line.s | grep -c 'warning:' || true
}

version=$(compile 20 -version plain.hpp -o version.s)
version=${version%%$'\n'*}
echo "$version"
[[ $version == *"version 12.2.0"* ]]
for standard in 20 17; do
  compile $standard precompiled.hpp -o precompiled.s --output-pch=precompiled.hpp.gch
  echo "C++$standard: $(warnings $standard precompiled.hpp) precompiled, $(warnings $standard plain.hpp) included"
  [[ $(warnings $standard plain.hpp) == 0 ]]
  [[ $(warnings $standard precompiled.hpp) == $((standard == 20)) ]]
done
echo "as before"
