"""How blocks get done: submitted, collected as they come, written, and submitted again where a scheduler is lost."""

from __future__ import annotations

import contextlib
import uuid
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from . import worker as on_worker
from .cluster import Cluster, client_of, local_cluster, local_workers, need_distributed
from .folder import CampaignError, Folder
from .plan import Block, Plan
from .progress import Progress

AT_ONCE = 2000  # blocks that the scheduler knows of
ROUNDS = 3  # schedulers in a row that are lost without a block done


@dataclass(frozen=True)
class Place:
    """Where blocks run, and how often they are tried."""

    cluster: Cluster = None
    workers: int | None = None
    threads: int | None = None
    gpus: int = 0
    retries: int = 3
    wait: float = 60.0  # s, for a scheduler
    command: tuple[str, ...] = ()


@dataclass
class Done:
    """What became of the blocks."""

    kept: dict[str, dict[str, Any]]  # block.json by name
    failed: dict[str, str] = field(default_factory=dict)  # why, by name
    bad_input: bool = False
    retries: int = 0
    ran: int = 0


class SchedulerLost(Exception):
    """Futures are cancelled though nobody asked: their scheduler is gone."""


def by_value(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function of worker.py that workers load without having its module.

    cloudpickle's registry of modules to pickle by value is not asked for functions within a graph, which go by name.
    """
    import cloudpickle

    class Carried:
        def __reduce__(self) -> tuple[Any, ...]:
            return cloudpickle.loads, (content,)

        def __call__(self, *arguments: Any) -> Any:
            return function(*arguments)

    cloudpickle.register_pickle_by_value(on_worker)
    try:
        content = cloudpickle.dumps(function)
    finally:
        cloudpickle.unregister_pickle_by_value(on_worker)
    return Carried()


def run_blocks(plan: Plan, folder: Folder, about: dict[str, str], place: Place, quiet: bool) -> Done:
    """Runs what blocks/ lacks of a plan and keeps each block as it comes. Raises CampaignError for what stops all."""
    kept, wrong = folder.kept(plan, about)
    done = Done(kept)
    missing = [block for block in plan.blocks if block.name not in done.kept]
    if missing:
        need_distributed()
    cases = sum(block.cases for block in plan.blocks)
    with Progress(plan.unit, cases, cases - sum(block.cases for block in missing), quiet or not missing) as progress:
        for text in wrong:
            progress.say(text)
        if missing:
            if not isinstance(place.retries, int) or not 0 <= place.retries <= 1000:
                raise CampaignError(2, f"retries: {place.retries}, expected 0 to 1000")
            _on(place, _Work(plan, folder, about, place, progress, done), missing)
    done.retries = progress.retries
    return done


def _on(place: Place, work: _Work, missing: list[Block]) -> None:
    if place.cluster is None:
        workers, work.threads = local_workers(place.workers, place.threads, place.gpus)
        with local_cluster(workers, place.gpus, place.retries) as cluster, client_of(cluster, place.wait) as client:
            try:
                work.round(client, missing)
            except SchedulerLost:
                raise CampaignError(3, "the local scheduler was lost") from None
        return
    if place.gpus or place.workers:
        raise CampaignError(2, "workers, gpus: given, expected neither with a scheduler: its workers are there")
    work.threads = place.threads or 1
    lost = 0
    while missing:
        before = len(missing)
        try:
            with client_of(place.cluster, place.wait) as client:
                work.round(client, missing)
        except SchedulerLost:
            work.progress.workers.clear()
            work.progress.say("the scheduler was lost; waits for it, and submits again what is not done")
        missing = [b for b in missing if b.name not in work.done.kept and b.name not in work.done.failed]
        lost = lost + 1 if len(missing) == before else 0
        if lost == ROUNDS:
            raise CampaignError(3, f"the scheduler was lost {ROUNDS} times in a row")


class _Work:
    """One campaign's blocks on one client after another."""

    def __init__(self, plan: Plan, folder: Folder, about: dict[str, str], place: Place, progress: Progress, done: Done):
        self.plan, self.folder, self.about, self.place = plan, folder, about, place
        self.progress, self.done, self.threads = progress, done, 1
        self.topic = f"decant-campaign-{uuid.uuid4().hex[:12]}"
        self.sent = {name: Path(name).read_bytes() for name in plan.inputs if not Path(name).is_absolute()}

    def round(self, client: Any, missing: Iterable[Block]) -> None:
        """Until all are done or failed. Raises SchedulerLost, CampaignError."""
        from distributed import as_completed

        run_block, content_of = by_value(on_worker.run_block), by_value(on_worker.content_of)
        client.subscribe_topic(self.topic, self.progress.note)
        client.subscribe_topic("all", self.progress.note_worker)
        self.progress.workers |= set(client.nthreads())
        blocks = iter(missing)
        of: dict[Any, Block] = {}
        try:
            group = f"{self.topic}-{uuid.uuid4().hex[:6]}"
            sent = client.submit(content_of, self.sent, key=f"{group}-files", pure=False) if self.sent else {}

            def submit_next() -> None:
                block = next(blocks, None)
                if block is None:
                    return
                task = {
                    "name": block.name, "arguments": self._arguments(block), "command": list(self.place.command),
                    "threads": self.threads, "topic": self.topic, "folders": list(block.folders),
                    "report": block.report, **self.about,
                }  # fmt: skip
                future = client.submit(run_block, task, sent, key=(group, block.name), pure=False,
                                       retries=self.place.retries)  # fmt: skip
                of[future] = block
                coming.add(future)

            # Nothing else holds a future: a result that is written is let go, or the death of its worker, which has
            # it in memory, would have the block run again.
            coming = as_completed(loop=client.loop)
            for _ in range(AT_ONCE):
                submit_next()
            for future in coming:
                self._take(future, of.pop(future))
                del future
                submit_next()
        finally:
            with contextlib.suppress(Exception):  # of a scheduler that is gone
                client.cancel(list(of))
                # Or the scheduler tells a client that is closing of its own departure, and logs that it cannot.
                client.unsubscribe_topic("all")

    def _arguments(self, block: Block) -> list[str]:
        # Not of the block's identity: the same seeds give the same statistics by any number of threads.
        return [*block.arguments, *(["--threads", str(self.threads)] if self.plan.verb == "fuzz" else [])]

    def _take(self, future: Any, block: Block) -> None:
        from distributed import CancelledError, KilledWorker

        try:
            outcome = future.result()
        except CancelledError:
            raise SchedulerLost from None
        except KilledWorker as error:
            text = f"{error.allowed_failures + 1} workers died while they ran it, the last {error.last_worker.address}"
            self._fail(block, text)
            return
        except Exception as error:
            self._fail(block, str(error).strip() or type(error).__name__)
            return
        if "refused" in outcome:
            raise CampaignError(3, outcome["refused"])
        if outcome["status"] not in (0, 1):
            self.done.bad_input |= outcome["status"] == 2
            text = f"decant ended with status {outcome['status']} on {outcome['worker']}: {outcome['said']}"
            if outcome["status"] == 2 and self.plan.ends_with_bad_input:
                raise CampaignError(2, f"block {block.name}: {text}")
            self._fail(block, text)
            return
        self.folder.keep(block.name, outcome, {**self.about, **block.identity()})
        self.done.kept[block.name] = self.folder.block(block.name, {})
        self.done.ran += 1
        self.progress.done += block.cases

    def _fail(self, block: Block, text: str) -> None:
        self.done.failed[block.name] = text
        self.progress.say(f"block {block.name}: {text}")
