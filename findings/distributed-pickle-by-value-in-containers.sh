#!/usr/bin/env bash
# distributed sends a function of a module registered with cloudpickle.register_pickle_by_value by value when it stands
# alone, and by name when it stands in a tuple or a dictionary.
#
# Seen with   distributed 2026.8.0 and 2024.5.0, cloudpickle 3.1.3.
# Behavior    cloudpickle.dumps writes the function's code in all three cases, and a process without the module loads
#             it. distributed.protocol.pickle.dumps, which carries tasks and their arguments, does so for the function
#             alone; of a tuple or a dictionary that holds it, it writes the name of the module.
# Cause       It tries plain pickle first, which succeeds, and asks cloudpickle's registry only about the type and
#             module of the outermost object.
# Output seen as asserted below: 491 bytes and the code for the function, 32 and 35 bytes and a ModuleNotFoundError for
#             the tuple and the dictionary.
# Why         Whoever registers a port's module so that workers need not have it finds that some calls work and some
#             fail on the worker, by how the function is passed on. Send the bytes of cloudpickle.dumps instead.
set -euo pipefail
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --no-compile --disable-pip-version-check --only-binary=:all: \
    distributed==2026.8.0 cloudpickle==3.1.3
mkdir "$dir/module"
printf 'def step(x):\n    return x + 1\n' >"$dir/module/port.py"
cd "$dir"
"$dir/venv/bin/python" - <<'PY'
import subprocess
import sys

import cloudpickle
import distributed
from distributed.protocol import pickle as wire

sys.path.insert(0, "module")
import port  # noqa: E402

cloudpickle.register_pickle_by_value(port)
LOAD = "import pickle, sys; print(pickle.load(sys.stdin.buffer))"


def loaded_without_the_module(data):
    run = subprocess.run([sys.executable, "-c", LOAD], input=data, capture_output=True)
    return (run.stdout or run.stderr).decode().strip().splitlines()[-1]


print("distributed", distributed.__version__, "cloudpickle", cloudpickle.__version__)
missing = []
for name, sent in (("function", port.step), ("tuple", (port.step, 1)), ("dictionary", {"k": port.step})):
    for by, dumps in (("cloudpickle", cloudpickle.dumps), ("distributed", wire.dumps)):
        data = dumps(sent)
        result = loaded_without_the_module(data)
        print(f"{name:11}{by:12}{len(data):5} bytes: {result}")
        if "ModuleNotFoundError" in result:
            missing.append((name, by))
        else:
            assert "<function step" in result, result
assert missing == [("tuple", "distributed"), ("dictionary", "distributed")], missing
PY
