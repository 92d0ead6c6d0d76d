"""What a campaign says of itself on standard error while it runs."""

from __future__ import annotations

import math
import shutil
import sys
import threading
import time

SECONDS_BETWEEN = {True: 0.5, False: 30.0}  # of a terminal, and else


def duration(seconds: float) -> str:
    """As the command says it: 3 h 05 min, 2 min 07 s, 41 s."""
    s = math.ceil(max(seconds, 0))
    if s >= 3600:
        return f"{s // 3600} h {s % 3600 // 60:02} min"
    return f"{s // 60} min {s % 60:02} s" if s >= 60 else f"{s} s"


class Progress:
    """Counts, and a thread that shows them now and then."""

    def __init__(self, unit: str, asked: int, done: int, quiet: bool):
        self.unit, self.asked, self.before, self.done, self.quiet = unit, asked, done, done, quiet
        self.workers: set[str] = set()
        self.started: dict[str, int] = {}  # attempts by block
        self.begin = time.monotonic()
        self._terminal = sys.stderr.isatty()
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._show, daemon=True)

    def __enter__(self) -> Progress:
        if not self.quiet:
            self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        if not self.quiet:
            self._thread.join()
            self._print(last=True)

    @property
    def retries(self) -> int:
        """Attempts beyond the first of each block."""
        return sum(attempts - 1 for attempts in self.started.values())

    def note(self, event: tuple[float, dict[str, str]]) -> None:
        """Takes a worker's event: it has started a block."""
        name = event[1].get("started", "")
        self.started[name] = self.started.get(name, 0) + 1

    def note_worker(self, event: tuple[float, dict[str, str]]) -> None:
        """Takes a scheduler's event: a worker has come or gone."""
        action, worker = event[1].get("action"), event[1].get("worker", "")
        if action == "add-worker":
            self.workers.add(worker)
        elif action == "remove-worker":
            self.workers.discard(worker)

    def say(self, text: str) -> None:
        """A line of its own, --quiet or not: what went wrong."""
        print(("\r\x1b[K" if self._terminal and not self.quiet else "") + text, file=sys.stderr, flush=True)

    def text(self) -> str:
        """The line."""
        elapsed = time.monotonic() - self.begin
        here = self.done - self.before
        parts = [f"{self.unit} {self.done:,}/{self.asked:,}".replace(",", " ")]
        if here:
            parts.append(f"{here / elapsed:.3g} per second")
        if self.done >= self.asked:
            parts.append(f"took {duration(elapsed)}")
        elif here:
            parts.append(f"{duration(elapsed * (self.asked - self.done) / here)} left")
        workers = len(self.workers)
        parts.append(f"{workers} worker{'' if workers == 1 else 's'}" if workers else "waits for workers")
        if self.retries:
            parts.append(f"{self.retries} retr{'y' if self.retries == 1 else 'ies'}")
        return ", ".join(parts)

    def _show(self) -> None:
        while not self._over.wait(SECONDS_BETWEEN[self._terminal]):
            self._print()

    def _print(self, last: bool = False) -> None:
        if not self._terminal:
            print(self.text(), file=sys.stderr, flush=True)
            return
        columns = shutil.get_terminal_size().columns
        print("\r\x1b[K" + self.text()[: columns - 1], end="\n" if last else "", file=sys.stderr, flush=True)
