#!/usr/bin/env python3
"""Measures what looking at a pour costs: pictures per second of `decant live`, and how much slower the solver is.

    live_rate.py OUT.json [--particles N …] -- SCENE [options of decant live]

A program that draws nothing takes each picture over the socket and asks for the next, for --seconds; then nobody looks
for as long; so for --windows times. Rates are substeps over seconds, from the statuses at both ends. Needs the package
websocket-client.
"""

import argparse
import json
import signal
import statistics
import subprocess
import time
from pathlib import Path

import websocket

from one_line import run_main
from study_runs import run


class Live:
    def __init__(self, command):
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        self.address = self.process.stdout.readline().strip().replace("http", "ws") + "socket"
        self.scene = None

    def look(self, seconds):
        """Pictures, bytes of a picture, and the statuses first and last, each with its clock."""
        socket = websocket.create_connection(self.address, timeout=300)
        socket.settimeout(300)
        pictures, size, first, last, fresh = 0, 0, None, None, False
        # What a newcomer is told first is of before.
        while last is None or last[0] - first[0] < seconds:
            message = socket.recv()
            if isinstance(message, bytes):
                pictures += first is not None
                size = len(message)
                socket.send("drawn")
                continue
            told = json.loads(message)
            self.scene = told if told["type"] == "scene" else self.scene
            if told["type"] == "error":
                raise RuntimeError(told["text"])
            if told["type"] == "status":
                if fresh:
                    last = (time.monotonic(), told["substep"])
                    first = first or last
                fresh = True
        socket.close()
        return pictures / (last[0] - first[0]), size, first, last

    def memory(self):
        """MB that the process holds."""
        status = Path(f"/proc/{self.process.pid}/status").read_text()
        return int(status.split("VmRSS:")[1].split()[0]) / 1024

    def end(self):
        self.process.send_signal(signal.SIGINT)
        self.process.wait(60)


def rate(first, last):
    return (last[1] - first[1]) / (last[0] - first[0])


def measure(command, seconds, windows):
    live = Live(command)
    rows, before = [], None
    try:
        for _ in range(windows):
            unwatched = live.memory()
            pictures, size, first, last = live.look(seconds)
            memory = live.memory()
            if before:
                rows[-1]["unwatched"] = rate(before, first)
            rows.append({"watched": rate(first, last), "pictures": pictures, "memory": memory - unwatched})
            before = last
            time.sleep(seconds)
        rows[-1]["unwatched"] = rate(before, live.look(0.1)[2])
    finally:
        live.end()
    median = {key: statistics.median(row[key] for row in rows) for key in rows[0]}
    return {"scene": live.scene["name"], "particles": live.scene["particles"], "backend": live.scene["backend"],
            "device": live.scene["device"], "pictures_per_second": median["pictures"], "picture_bytes": size,
            "substeps_per_second": median["unwatched"], "substeps_per_second_watched": median["watched"],
            "slower_percent": 100 * (1 - median["watched"] / median["unwatched"]),
            "more_memory_MB": max(row["memory"] for row in rows), "windows": rows}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--particles", type=int, action="append", help="may be repeated; default: the scene's")
    parser.add_argument("--seconds", type=float, default=5)
    parser.add_argument("--windows", type=int, default=3)
    parser.add_argument("--decant", default="build/release/bin/decant")
    parser.add_argument("scene", nargs="+", help="and options of decant live, after --")
    arguments = parser.parse_args()
    rows = []
    for particles in arguments.particles or [None]:
        size = ["--particles", str(particles)] if particles else []
        rows.append(measure([arguments.decant, "live", *arguments.scene, *size, "--quiet"], arguments.seconds,
                            arguments.windows))
        print({key: value for key, value in rows[-1].items() if key != "windows"}, flush=True)
    info = json.loads(run([arguments.decant, "info", "--json"]))
    arguments.out.write_text(json.dumps({"provenance": {"git_revision": info["git_revision"]}, "rows": rows}, indent=1))
    return 0


if __name__ == "__main__":
    run_main(main)
