"""How a worker of the cluster runs one block: `decant` as a process of its own, in a folder of its own.

The functions go to the worker by value, so that it needs Python, distributed and the command, and not this package.
They use the standard library alone and name nothing of the package.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

# The kernel kills the command when the worker is gone, whatever it died of. Set by a process in between, because
# Python's preexec_fn is not safe beside the threads of a worker.
LAUNCHER = """
import ctypes, os, signal, sys
ctypes.CDLL(None).prctl(1, signal.SIGKILL)
if os.getppid() != int(sys.argv[1]):
    os._exit(127)
try:
    os.execv(sys.argv[2], sys.argv[2:])
except OSError as error:
    print(f"{sys.argv[2]}: {error.strerror}", file=sys.stderr)
os._exit(127)
"""


def command_at(places: list[str]) -> str:
    """The first of these that can be run here; a name without a slash is looked up on the PATH."""
    for place in places:
        found = shutil.which(place)
        if found:
            return os.path.abspath(found)
    raise FileNotFoundError(f"decant: {' or '.join(places)}: no command here; --decant names it")


def about(command: str) -> dict[str, str]:
    """Version and git revision of a command. Raises OSError where it cannot say."""
    done = subprocess.run([command, "info", "--json"], capture_output=True, text=True)
    try:
        found = json.loads(done.stdout)
        return {"version": str(found["version"]), "git_revision": str(found["git_revision"])}
    except (ValueError, KeyError):
        said = (done.stderr or done.stdout).strip().splitlines() or [f"status {done.returncode}"]
        raise OSError(f"{command}: info --json: {said[-1]}, expected version and git_revision") from None


def environment(threads: int) -> dict[str, str]:
    """Of the command: ports in Python run in the worker's; OpenMP has the block's threads, not the one that a nanny
    leaves to a worker."""
    found = os.pathsep.join(path or os.getcwd() for path in sys.path if not path.endswith(".zip"))
    return {"DECANT_PYTHON": sys.executable, **os.environ, "PYTHONPATH": found, "OMP_NUM_THREADS": str(threads)}


def unwanted(worker: Any, key: Any) -> bool:
    """Whether nobody waits for the task any more: it was cancelled, its client or scheduler is gone."""
    if worker is None:
        return False
    task = worker.state.tasks.get(key)
    return task is None or task.state == "cancelled" or worker.status.name in ("closing", "closed", "failed")


def last_line(folder: Path, status: int) -> str:
    """What the command said last: its verdict, or why there is none. The end of a JSON text says nothing."""
    for name in ("stdout.txt", "stderr.txt") if status in (0, 1) else ("stderr.txt", "stdout.txt"):
        lines = (folder / name).read_text(encoding="utf-8", errors="replace").strip().splitlines()
        if lines and lines[-1].strip(" ]}"):
            return lines[-1].strip()
    return "it said nothing"


def wait_for(process: subprocess.Popen, worker: Any, key: Any) -> int:
    """The exit status, or minus the signal. Kills the command, and what it started, where nobody waits for it."""
    try:
        while True:
            try:
                return process.wait(timeout=1)
            except subprocess.TimeoutExpired:
                if unwanted(worker, key):
                    raise ChildProcessError("the block was cancelled") from None
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()


def run_block(block: dict[str, Any], sent: dict[str, bytes]) -> dict[str, Any]:
    """Runs one block and returns what it wrote, as bytes.

    block: name, arguments of decant, where the command is (command), version and git_revision that it has to have,
    threads, topic of events, folders to make. sent: files that the command finds in its folder.
    Raises ChildProcessError for what another attempt may mend: a signal, status 3, a report that is not there.
    """
    import time

    worker, key = None, None
    try:
        from distributed import get_worker

        worker = get_worker()
        key = worker.get_current_task()
        worker.log_event(block["topic"], {"started": block["name"], "worker": worker.address})
    except (ImportError, ValueError):
        pass
    address = worker.address if worker else "this process"
    begin = time.perf_counter()
    try:
        command = command_at(block["command"])
        here = about(command)
    except OSError as error:
        return {"refused": f"worker {address}: {error}"}
    for name, value in here.items():
        if value != block[name]:
            return {"refused": f"worker {address}: {command}: {name}: {value}, expected {block[name]}"}
    place = getattr(worker, "local_directory", None)
    with tempfile.TemporaryDirectory(dir=place, prefix="decant-", ignore_cleanup_errors=True) as made:
        folder, work = Path(made), Path(made) / "work"
        for name in ("", *block["folders"]):
            (work / name).mkdir(parents=True, exist_ok=True)
        for name, content in sent.items():
            (work / name).parent.mkdir(parents=True, exist_ok=True)
            (work / name).write_bytes(content)
        with open(folder / "stdout.txt", "wb") as out, open(folder / "stderr.txt", "wb") as err:
            launched = [sys.executable, "-I", "-S", "-c", LAUNCHER, str(os.getpid()), command, *block["arguments"]]
            process = subprocess.Popen(
                launched, cwd=work, env=environment(block["threads"]), stdin=subprocess.DEVNULL, stdout=out, stderr=err,
                start_new_session=True,
            )  # fmt: skip
            status = wait_for(process, worker, key)
        if status < 0:
            raise ChildProcessError(f"decant was ended by signal {-status} on {address}")
        if status not in (0, 1, 2, 77):
            raise ChildProcessError(f"decant ended with status {status} on {address}: {last_line(folder, status)}")
        files = {name: (folder / name).read_bytes() for name in ("stdout.txt", "stderr.txt")}
        for path in sorted(work.rglob("*")):
            name = str(path.relative_to(work))
            if path.is_file() and not (name in sent and path.read_bytes() == sent[name]):
                files[name] = path.read_bytes()
        if status in (0, 1) and block["report"] and block["report"] not in files:
            raise ChildProcessError(f"decant ended with status {status} and wrote no {block['report']} on {address}")
        return {
            "status": status, "files": files, "said": last_line(folder, status), "worker": address,
            "seconds": time.perf_counter() - begin,
        }  # fmt: skip


def content_of(files: dict[str, bytes]) -> dict[str, bytes]:
    """Files that the client sends, as a task: what is lost with a worker comes again, which scattered data does not."""
    return files
