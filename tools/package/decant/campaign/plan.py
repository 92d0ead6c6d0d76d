"""Which blocks a campaign is made of: what each asks of `decant`, and which files go with it."""

from __future__ import annotations

import math
import re
import shlex
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePath
from typing import Any

REPORT = "report.h5"
COUNTEREXAMPLES = "counterexamples"
MOST_BLOCKS = 1_000_000  # of one campaign
MINIMISE = "minimise-"  # blocks beside those of seeds
# Options of all verbs that say where to write.
OUTPUTS = ("--report", "--junit", "--reproducers", "--failures", "--out")


@dataclass(frozen=True)
class Block:
    """One call of the command."""

    name: str  # its folder in blocks/
    arguments: tuple[str, ...]
    cases: int = 1  # what progress counts
    report: str = REPORT  # has to be written; empty: nothing has to
    folders: tuple[str, ...] = ()  # made before the command runs

    def identity(self) -> dict[str, Any]:
        """What block.json says of it."""
        return {"name": self.name, "arguments": list(self.arguments)}


@dataclass(frozen=True)
class Plan:
    """A campaign: what was asked, in JSON's types, and its blocks."""

    verb: str
    asked: dict[str, Any]
    blocks: tuple[Block, ...]
    unit: str = "blocks"
    inputs: tuple[str, ...] = ()  # files that blocks name; those that are not absolute are sent to workers
    ends_with_bad_input: bool = False  # one block's bad input is every block's
    extra: dict[str, Any] = field(default_factory=dict)


def number(option: str, value: Any, low: int, high: int) -> int:
    """A whole number within bounds. Raises ValueError naming option, value and bounds."""
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise ValueError(f"{option}: {value}, expected {low} to {high}")
    return value


def plain(name: str) -> str:
    """A name that a folder may have."""
    return re.sub(r"[^A-Za-z0-9.=_-]", "-", name)


def inputs_of(words: Iterable[str]) -> list[str]:
    """Files of this machine that words of a command line name: a path, plugin:PATH or python:FILE.py:CLASS.

    Raises ValueError for a relative path out of this folder, which a worker could not have.
    """
    found = []
    for word in words:
        match = re.match(r"(?:plugin|python):([^:]+)", word)
        path = match[1] if match else word
        if not path or not Path(path).is_file():
            continue
        if ".." in PurePath(path).parts and not PurePath(path).is_absolute():
            raise ValueError(f"{path}: expected a file below this folder, to be sent, or an absolute path")
        found.append(str(PurePath(path)))
    return sorted(set(found))


def _common(backend: str | None, executor: str) -> list[str]:
    return [*(["--backend", backend] if backend else []), "--executor", executor]


def fuzz_plan(
    *, backend: str, cases: int, seed: int = 1, properties: Sequence[str] = (), executor: str = "auto",
    block_cases: int = 200, minimise: bool = True,
) -> Plan:  # fmt: skip
    """Blocks of consecutive seeds. Raises ValueError."""
    number("cases", cases, 1, 1 << 40)
    number("seed", seed, 0, (1 << 63) - 1 - cases)
    number("block", block_cases, math.ceil(cases / MOST_BLOCKS), 1 << 40)
    if not isinstance(backend, str):
        raise ValueError(f"backend: {backend!r}, expected a name; a port is python:FILE:CLASS")
    asked = {
        "backend": backend, "executor": executor, "seed": seed, "cases": cases, "properties": list(properties),
        "minimise": minimise,
    }  # fmt: skip
    blocks = []
    # No seed is left out, however many fail: a block ends when all its seeds are done. Counterexamples are minimised
    # once for the campaign, not once in each block.
    for k in range(math.ceil(cases / block_cases)):
        first = seed + k * block_cases
        count = min(block_cases, seed + cases - first)
        blocks.append(Block(
            f"seeds-{first}-{first + count - 1}",
            fuzz_arguments(backend, executor, properties, first, count, "--no-minimise"), count,
        ))  # fmt: skip
    return Plan("fuzz", asked, tuple(blocks), "cases", tuple(inputs_of(backend.split(","))),
                extra={"block_cases": block_cases}, ends_with_bad_input=True)  # fmt: skip


def fuzz_arguments(backend: str, executor: str, properties: Sequence[str], first: int, count: int,
                   *more: str) -> tuple[str, ...]:  # fmt: skip
    """Of one block."""
    chosen = ["--property", ",".join(properties)] if properties else []
    return (
        "fuzz", *_common(backend, executor), *chosen, "--seed", str(first), "--cases", str(count),
        "--most-counterexamples", "10000", "--failures", COUNTEREXAMPLES, "--report", REPORT, "--quiet", *more,
    )  # fmt: skip


def minimising_block(backend: str, executor: str, prop: str, seed: int) -> Block:
    """One seed again, whose counterexample is minimised."""
    return Block(plain(f"{MINIMISE}{seed}-{backend}-{prop}"), fuzz_arguments(backend, executor, [prop], seed, 1))


def drift_plan(
    inputs: Sequence[str], *, backend: str = "list", executor: str = "auto",
    intervals: Sequence[int] = (1, 2, 5, 10, 20, 50), skins: Sequence[float] = (0, 0.05, 0.1, 0.2),
    window: int | None = None, samples: int | None = None, timed: bool = True, full_run: bool = False,
    split: str = "input",
) -> Plan:  # fmt: skip
    """A block per input, or per input and interval or skin. Raises ValueError."""
    if not inputs:
        raise ValueError("inputs: none, expected recordings or scenes (*.json)")
    if split not in ("input", "interval", "skin"):
        raise ValueError(f"split: {split}, expected input, interval or skin")
    for option, values in (("intervals", intervals), ("skins", skins), ("inputs", inputs)):
        if len(set(values)) != len(values) or not values:
            raise ValueError(f"{option}: {','.join(map(str, values))}, expected values that differ")
    asked = {
        "inputs": list(inputs), "backend": backend, "executor": executor, "intervals": list(intervals),
        "skins": [float(s) for s in skins], "window": window, "samples": samples, "timed": timed,
        "full_run": full_run, "split": split,
    }  # fmt: skip
    parts = [(list(intervals), list(skins), "")]
    if split == "interval":
        parts = [([n], list(skins), f"-interval-{n}") for n in intervals]
    elif split == "skin":
        parts = [(list(intervals), [s], f"-skin-{float(s):g}") for s in skins]
    blocks = []
    for number_of, one in enumerate(inputs):
        for some_intervals, some_skins, behind in parts:
            arguments = ["drift", one, *_common(backend, executor), "--report", REPORT, "--quiet"]
            arguments += ["--intervals", ",".join(map(str, some_intervals))]
            arguments += ["--skins", ",".join(f"{float(s):.17g}" for s in some_skins)]
            arguments += [] if window is None else ["--window", str(window)]
            arguments += [] if samples is None else ["--samples", str(samples)]
            arguments += [] if timed else ["--untimed"]
            arguments += ["--full-run"] if full_run else []
            blocks.append(Block(plain(f"{number_of:04}-{Path(one).stem}{behind}"), tuple(arguments)))
    return Plan("drift", asked, tuple(blocks), inputs=tuple(inputs_of([*inputs, backend])))


def validate_plan(
    cases: Sequence[str], *, backend: str = "reference", executor: str = "auto", resolutions: Sequence[int] = (),
    quick: bool = False,
) -> Plan:  # fmt: skip
    """A block per case. Raises ValueError."""
    if not cases or len(set(cases)) != len(cases):
        raise ValueError(f"cases: {','.join(cases) or 'none'}, expected names that differ")
    asked = {"cases": list(cases), "backend": backend, "executor": executor, "resolutions": list(resolutions),
             "quick": quick}  # fmt: skip
    chosen = ["--resolution", ",".join(map(str, resolutions))] if resolutions else []
    chosen += ["--quick"] if quick else []
    blocks = [
        Block(name, ("validate", name, *_common(backend, executor), *chosen, "--report", REPORT, "--quiet"))
        for name in cases
    ]
    return Plan("validate", asked, tuple(blocks), inputs=tuple(inputs_of([backend])))


def study_plan(lines: Sequence[str], send: Sequence[str] = ()) -> Plan:
    """A block per command line, without the word decant; empty lines and those that begin with # are left out.

    Raises ValueError for a line that writes out of its block's folder.
    """
    blocks, words = [], list(send)
    kept = [line.strip() for line in lines if line.strip() and not line.lstrip().startswith("#")]
    if not kept:
        raise ValueError("lines: none, expected command lines of decant")
    for k, line in enumerate(kept, 1):
        arguments = shlex.split(line)
        if arguments[0] == "decant":
            arguments = arguments[1:]
        folders = set()
        for option, value in zip(arguments, arguments[1:]):
            if option in OUTPUTS:
                if PurePath(value).is_absolute() or ".." in PurePath(value).parts:
                    raise ValueError(f"line {k}: {option}: {value}, expected a relative path, on a worker")
                folders.add(str(PurePath(value).parent))
        words += [part for word in arguments for part in word.split(",")]
        verb = re.sub(r"[^a-z]", "-", arguments[0])
        blocks.append(Block(f"{k:04}-{verb}", tuple(arguments), report="", folders=tuple(sorted(folders))))
    return Plan("study", {"lines": kept}, tuple(blocks), inputs=tuple(inputs_of(words)))
