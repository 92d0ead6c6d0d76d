"""What tests of campaigns share: a campaign as a process, a cluster that can be killed, reports to compare."""

import contextlib
import os
import socket
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np

CASES, BLOCK = 160, 8
ASKED = {"backend": "hash", "executor": "host", "properties": ["fields"], "cases": CASES, "block": BLOCK}
OPTIONS = ["--backend", "hash", "--executor", "host", "--property", "fields", "--cases", str(CASES)]


def everything(file, without=("seconds", "device")):
    """All datasets and attributes of a report that do not say how long it took, and where."""
    found = {}

    def take(name, item):
        if isinstance(item, h5py.Dataset):
            found[name] = repr(item[()].tolist())  # where NaN is NaN
        found.update({f"{name}@{key}": repr(np.asarray(value).tolist()) for key, value in item.attrs.items()})

    with h5py.File(file) as opened:
        take("", opened)
        opened.visititems(take)
    return {key: value for key, value in found.items() if not key.endswith(without)}


def client(folder, seed, *more):
    """A campaign in a process of its own."""
    words = [sys.executable, "-m", "decant.campaign.command", "fuzz", *OPTIONS, "--seed", str(seed)]
    words += ["--block", str(BLOCK), "--folder", str(folder), *more]
    return subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True)


def finished(process, seconds=60):
    out, err = process.communicate(timeout=seconds)
    return process.returncode, out, err


def wait_for(condition, seconds=30):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "it did not come to this"
        time.sleep(0.02)


def blocks(folder):
    return {path: path.stat().st_ino for path in Path(folder, "blocks").glob("[!.]*")}


def commands_of(seed):
    """Processes of the command that run a block of this session's seeds."""
    found = []
    for line in Path("/proc").glob("[0-9]*/cmdline"):
        with contextlib.suppress(OSError):
            words = line.read_bytes().split(b"\0")
            if b"--seed" in words and seed <= int(words[words.index(b"--seed") + 1]) < seed + CASES:
                if Path(os.fsdecode(words[0])).name == "decant":
                    found.append(int(line.parent.name))
    return found


class Cluster:
    """A scheduler and workers as processes, without nannies."""

    def __init__(self):
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self.port = probe.getsockname()[1]
        self.address = f"tcp://127.0.0.1:{self.port}"
        self.workers = []

    def __enter__(self):
        self.start_scheduler()
        for _ in range(2):
            self.start_worker()
        return self

    def __exit__(self, *_):
        for process in [*self.workers, self.scheduler]:
            process.kill()
            process.wait()

    def _start(self, *words, **more):
        return subprocess.Popen([sys.executable, "-m", *words], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                                start_new_session=True, **more)  # fmt: skip

    def start_scheduler(self):
        self.scheduler = self._start("distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", str(self.port),
                                     "--no-dashboard")  # fmt: skip

    def start_worker(self, **more):
        self.workers.append(self._start("distributed.cli.dask_worker", self.address, "--no-nanny", "--nthreads", "1",
                                        "--no-dashboard", "--host", "127.0.0.1", **more))  # fmt: skip

    def busy(self, seed):
        """Numbers of workers that run a block."""
        parents = []
        for number in commands_of(seed):
            with contextlib.suppress(OSError):
                status = Path(f"/proc/{number}/status").read_text()
                parents.append(int(status.split("PPid:")[1].split()[0]))
        return [k for k, worker in enumerate(self.workers) if worker.pid in parents]

    def kill_worker(self, which):
        process = self.workers.pop(which)
        process.kill()
        process.wait()
        return True
