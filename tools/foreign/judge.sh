#!/usr/bin/env bash
# Judges public SPH codes: tools/foreign/judge.sh CODE… , or all of them; see tools/foreign/README.md.
#
# For each CODE it makes a virtual environment in a temporary folder, installs what packages/CODE.txt pins, runs
# CODE.py, which calls `decant conform`, and leaves fixtures/results/foreign/CODE.json and the page made from these.
# Ends with status 1 where a code does not do what its driver says of it. Needs `decant` on the path, or DECANT.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$(cd "$here/../.." && pwd)
out=$root/fixtures/results/foreign

if [[ ${1:-} == --help || ${1:-} == -h ]]; then
  sed -n '2,/^set /{s/^# \{0,1\}//p}' "$0"
  exit 0
fi
DECANT=$(command -v "${DECANT:-decant}") || { echo "judge.sh: no decant on the path; set DECANT" >&2; exit 2; }
DECANT=$(realpath "$DECANT")
export DECANT
codes=("$@")
((${#codes[@]})) || codes=(nvidia_warp jaxsph pysph_opencl neighbor_lists taichi_example splishsplash)
for code in "${codes[@]}"; do
  [[ -f $here/packages/$code.txt ]] || { echo "judge.sh: no code '$code'" >&2; exit 2; }
done

dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
mkdir -p "$out" "$dir/home"
status=0
for code in "${codes[@]}"; do
  begin=$SECONDS
  python3 -m venv "$dir/venv"
  # Lists are complete, and some packages refuse a Python that they run on: dependencies are not resolved.
  # CODE-build.txt, where there is one, is what has to be there before the rest can be built.
  for list in "$here/packages/$code-build.txt" "$here/packages/$code.txt"; do
    [[ ! -f $list ]] || "$dir/venv/bin/pip" install --quiet --disable-pip-version-check --no-deps \
      --ignore-requires-python --no-build-isolation -r "$list"
  done
  installed=$SECONDS
  # Caches of compiled kernels go where the rest goes.
  (cd "$dir" && HOME=$dir/home PYTHONPATH=$root/tools/python:$here \
    "$dir/venv/bin/python" -W ignore "$here/$code.py" --out "$out/$code.json") || status=1
  echo "$code: installed in $((installed - begin)) s, judged in $((SECONDS - installed)) s"
  rm -rf "$dir/venv"
done
python3 "$here/table.py"
exit "$status"
