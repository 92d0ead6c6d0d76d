"""Campaigns: `fuzz`, `drift`, `validate` or any lines of the command, cut into blocks that run on a Dask cluster.

A block that is done is kept in the campaign's folder, whole; the same call again goes on with those that lack, whatever
died: a worker, the scheduler, this process, the machine. Each seed, interval or case counts once in the report.

    if __name__ == "__main__":  # local workers import this script
        decant.campaign.fuzz(backend="hash", cases=10_000, folder="build/campaign").require()

Needs distributed: pip install 'decant[campaign]'.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from . import plan as _plan
from . import whole as _whole
from .cluster import Cluster
from .folder import CampaignError, Folder, sha256
from .join import FuzzReport, ValidationReport
from .plan import Plan
from .run import Done, Place, run_blocks
from .worker import about, command_at

PathLike = str | os.PathLike[str]
COMMAND = Path(__file__).resolve().parents[1] / "bin" / "decant"  # the package's


@dataclass(frozen=True)
class Result:
    """What a campaign found."""

    status: int  # 0: all hold, 1: something does not conform
    text: str
    folder: Path
    report: Path | None  # report.h5; of a study index.json
    blocks: int  # all of them
    ran: int  # of them in this call; the others were there
    retries: int

    @property
    def passes(self) -> bool:
        """Whether all hold."""
        return self.status == 0

    def require(self) -> None:
        """Raises AssertionError with the text where something does not conform."""
        if not self.passes:
            raise AssertionError("\n" + self.text)


def fuzz(
    *, backend: str, cases: int, folder: PathLike, seed: int = 1, properties: Sequence[str] = (),
    executor: str = "auto", block: int | None = None, minimise: bool = True, cluster: Cluster = None,
    workers: int | None = None, threads: int | None = None, gpus: int = 0, retries: int = 3, wait: float = 60,
    decant: str | None = None, quiet: bool = False,
) -> Result:  # fmt: skip
    """Property-based tests on the seeds `seed` … `seed + cases - 1`, in blocks of `block` seeds (200).

    backend: as --backend takes it; a plug-in or a Python file below the present folder is sent to the workers.
    folder: of the campaign; one that is there goes on. cluster: None: workers of this machine, or the address of a
    running scheduler, or a cluster object of distributed or dask-jobqueue. workers: processes of this machine; threads:
    of each block; gpus: a process for each of so many GPUs. retries: of a block whose worker or command dies.
    wait: s, for a scheduler. decant: the command, as workers find it. quiet: no progress on standard error.
    Raises CampaignError, whose `status` is the command's exit status: 2 for bad input, 3 where something could not run.
    """
    def plan(block_cases: int) -> Plan:
        return _plan.fuzz_plan(backend=backend, cases=cases, seed=seed, properties=properties, executor=executor,
                               block_cases=block_cases, minimise=minimise)  # fmt: skip

    place = _place(cluster, workers, threads, gpus, retries, wait, decant)
    return _campaign(Folder(folder), plan, block, place, quiet)


def drift(
    *inputs: PathLike, folder: PathLike, backend: str = "list", executor: str = "auto",
    intervals: Sequence[int] = (1, 2, 5, 10, 20, 50), skins: Sequence[float] = (0, 0.05, 0.1, 0.2),
    window: int | None = None, samples: int | None = None, timed: bool = True, full_run: bool = False,
    split: str = "input", cluster: Cluster = None, workers: int | None = None, threads: int | None = None,
    gpus: int = 0, retries: int = 3, wait: float = 60, decant: str | None = None, quiet: bool = False,
) -> Result:  # fmt: skip
    """What stale neighbor lists miss, in a block per input, or per interval or skin of it (split).

    inputs: recordings (a file below this folder is sent; a name is found by the workers) and scenes (*.json).
    intervals: substeps; skins: shares of H; window: substeps. timed: substeps are timed as well, which wants a machine
    or a GPU per worker. The rest as for fuzz(). Raises CampaignError.
    """
    def plan(_: int) -> Plan:
        return _plan.drift_plan([os.fspath(i) for i in inputs], backend=backend, executor=executor,
                                intervals=intervals, skins=skins, window=window, samples=samples, timed=timed,
                                full_run=full_run, split=split)  # fmt: skip

    place = _place(cluster, workers, threads, gpus, retries, wait, decant)
    return _campaign(Folder(folder), plan, None, place, quiet)


def validate(
    *cases: str, folder: PathLike, backend: str = "reference", executor: str = "auto",
    resolutions: Sequence[int] = (), quick: bool = False, cluster: Cluster = None, workers: int | None = None,
    threads: int | None = None, gpus: int = 0, retries: int = 3, wait: float = 60, decant: str | None = None,
    quiet: bool = False,
) -> Result:  # fmt: skip
    """Analytic solutions and experiments, in a block per case. The rest as for fuzz(). Raises CampaignError."""
    def plan(_: int) -> Plan:
        return _plan.validate_plan(list(cases), backend=backend, executor=executor, resolutions=resolutions,
                                   quick=quick)  # fmt: skip

    place = _place(cluster, workers, threads, gpus, retries, wait, decant)
    return _campaign(Folder(folder), plan, None, place, quiet)


def study(
    lines: Sequence[str], *, folder: PathLike, send: Sequence[str] = (), cluster: Cluster = None,
    workers: int | None = None, threads: int | None = None, gpus: int = 0, retries: int = 3, wait: float = 60,
    decant: str | None = None, quiet: bool = False,
) -> Result:  # fmt: skip
    """Lines of the command, each a block: conform, bench, and all other verbs.

    lines: "conform hostile-bowl --backend hash --report report.h5"; files that they write are found in blocks/. send:
    further files that they need, below the present folder. The rest as for fuzz(). Raises CampaignError.
    """
    place = _place(cluster, workers, threads, gpus, retries, wait, decant)
    return _campaign(Folder(folder), lambda _: _plan.study_plan(lines, send), None, place, quiet)


def _place(cluster: Cluster, workers: int | None, threads: int | None, gpus: int, retries: int, wait: float,
           decant: str | None) -> Place:  # fmt: skip
    command = (decant,) if decant else (str(COMMAND), "decant")
    return Place(cluster, workers, threads, gpus, retries, wait, command)


def _campaign(
    folder: Folder, plan_of: Callable[[int], Plan], block: int | None, place: Place, quiet: bool
) -> Result:  # fmt: skip
    try:
        version = about(command_at(list(place.command)))
    except OSError as error:
        raise CampaignError(2, str(error)) from None
    try:
        return _run(folder, plan_of, block, place, quiet, version)
    except OSError as error:
        named = f"{error.filename}: {error.strerror}" if error.filename else str(error)
        raise CampaignError(3, named) from error


def _run(
    folder: Folder, plan_of: Callable[[int], Plan], block: int | None, place: Place, quiet: bool,
    version: dict[str, str],
) -> Result:  # fmt: skip
    with folder.locked():
        found = folder.asked() or {}
        try:
            plan: Plan = plan_of(block if block is not None else found.get("block_cases") or 200)
        except ValueError as error:
            raise CampaignError(2, str(error)) from None
        files = {name: sha256(Path(name).read_bytes()) for name in plan.inputs}
        folder.begin({"verb": plan.verb, "asked": plan.asked, **plan.extra, **version, "sha256": files})
        for text in folder.foreign(plan):
            print(text, file=sys.stderr)
        done = run_blocks(plan, folder, version, place, quiet)
        return _finish(folder, plan, version, place, quiet, done)


def _finish(folder: Folder, plan: Plan, version: dict[str, str], place: Place, quiet: bool, done: Done) -> Result:
    text = _whole.write_index(folder, plan, done) if plan.verb == "study" else ""
    lacking = [block.name for block in plan.blocks if block.name not in done.kept]
    if lacking:
        more = f" and {len(lacking) - 5} more" if len(lacking) > 5 else ""
        why = done.failed.get(lacking[0], "not run")
        raise CampaignError(
            2 if done.bad_input else 3, f"{folder.path}: {len(lacking)} of {len(plan.blocks)} blocks are missing: "
            f"{', '.join(lacking[:5])}{more}; the first: {why}. The same campaign again runs them"
        )  # fmt: skip
    status, file = max(kept["status"] for kept in done.kept.values()), folder.path / "index.json"
    if plan.verb != "study":
        report = _whole.report_of(folder, plan, version)
        text = _whole.joined_text(folder, plan.blocks)
        if isinstance(report, FuzzReport):
            done, text = _counterexamples(folder, plan, version, place, quiet, done, report)
            status = int(report.failed() > 0)
        elif isinstance(report, ValidationReport):
            status = int(report.failed() > 0)
        file = _whole.write_report(folder, report)
        _whole.write_text(folder, text)
    return Result(status, text, folder.path, file, len(plan.blocks), done.ran, done.retries)


def _counterexamples(folder: Folder, plan: Plan, version: dict[str, str], place: Place, quiet: bool, done: Done,
                     report: FuzzReport) -> tuple[Done, str]:  # fmt: skip
    """Minimises one per property and backend, as further blocks. One that fails no more stays as it was found."""
    more = _whole.minimising_plan(plan, report) if plan.asked["minimise"] else Plan("fuzz", {}, ())
    if more.blocks:
        minimised = run_blocks(more, folder, version, place, quiet)
        for name in minimised.kept:
            report.minimised(folder.blocks / name / _plan.REPORT)
        done.retries += minimised.retries
    _whole.collect_counterexamples(folder, plan, more, report)
    return done, _whole.fuzz_text(report)


__all__ = ["CampaignError", "Cluster", "Result", "drift", "fuzz", "study", "validate"]
