"""Which Dask cluster the blocks run on: processes of this machine, one per core or per GPU, or one that is running."""

from __future__ import annotations

import contextlib
import logging
import os
from collections.abc import Iterator
from typing import Any

from .folder import CampaignError

#: None: this machine; "tcp://HOST:PORT": a running scheduler; or a cluster object of distributed or dask-jobqueue
Cluster = Any


def need_distributed() -> None:
    """Raises CampaignError where distributed is not installed."""
    try:
        import distributed  # noqa: F401
    except ImportError as error:
        raise CampaignError(
            2, f"campaigns run on Dask, and {error.name or 'distributed'} is not installed here: "
            "pip install 'decant[campaign]', or pip install distributed"
        ) from None  # fmt: skip


def cores() -> int:
    """That this process may use."""
    return len(os.sched_getaffinity(0))


def visible_gpus(count: int) -> list[str]:
    """The first GPUs of CUDA_VISIBLE_DEVICES, or of the machine. Raises CampaignError where they are fewer."""
    given = os.environ.get("CUDA_VISIBLE_DEVICES")
    if given is None:
        return [str(k) for k in range(count)]
    names = [name.strip() for name in given.split(",") if name.strip()]
    if len(names) < count:
        raise CampaignError(2, f"gpus: {count}, expected at most {len(names)}: CUDA_VISIBLE_DEVICES is {given!r}")
    return names[:count]


def local_workers(workers: int | None, threads: int | None, gpus: int) -> tuple[int, int]:
    """How many worker processes, and threads of each one's block. Raises CampaignError."""
    for option, value, most in (("workers", workers, 4096), ("threads", threads, 1024), ("gpus", gpus or None, 64)):
        if value is not None and not 1 <= value <= most:
            raise CampaignError(2, f"{option}: {value}, expected 1 to {most}")
    if gpus and workers not in (None, gpus):
        raise CampaignError(2, f"workers: {workers}, expected {gpus}: one for each of the GPUs")
    count = gpus or workers or max(1, cores() // (threads or 1))
    return count, threads or max(1, cores() // count)


@contextlib.contextmanager
def local_cluster(workers: int, gpus: int, retries: int) -> Iterator[Any]:
    """Worker processes of this machine, a block at a time each; a worker that dies is started again."""
    import dask
    from distributed import Nanny, Scheduler, SpecCluster

    silent = logging.CRITICAL + 1  # what fails is in the campaign's own messages
    names = visible_gpus(gpus) if gpus else [None] * workers
    # A worker has no data but one block's files. The block's memory is the command's, which Dask does not count.
    options = {"nthreads": 1, "memory_limit": 0, "silence_logs": silent, "host": "127.0.0.1"}
    # As LocalCluster makes them, which gives all of its workers one environment.
    spec = {
        k: {"cls": Nanny, "options": {**options, **({"env": {"CUDA_VISIBLE_DEVICES": name}} if name else {})}}
        for k, name in enumerate(names)
    }
    # A worker is given the block that it runs and no further one, which would be blamed for the worker's death.
    settings = {"distributed.scheduler.allowed-failures": retries, "distributed.scheduler.worker-saturation": 1.0}
    of_scheduler = {"dashboard": False, "dashboard_address": "127.0.0.1:0", "host": "127.0.0.1"}
    with (
        dask.config.set(settings),
        SpecCluster(
            workers=spec, scheduler={"cls": Scheduler, "options": of_scheduler}, silence_logs=silent
        ) as cluster,
    ):
        yield cluster


@contextlib.contextmanager
def client_of(cluster: Cluster, wait: float) -> Iterator[Any]:
    """A client of a cluster, or of the scheduler at an address. Raises CampaignError where it is not reached within
    `wait` seconds."""
    from distributed import Client

    with silenced():
        yield from _client(Client, cluster, wait)


@contextlib.contextmanager
def silenced() -> Iterator[None]:
    """Without the loggers of Dask in this process: what goes wrong is in the campaign's own messages."""
    names = [name for name in logging.root.manager.loggerDict if name.split(".")[0] in ("distributed", "tornado")]
    before = {name: logging.getLogger(name).level for name in names}
    for name in names:
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for name, level in before.items():
            logging.getLogger(name).setLevel(level)


def _client(kind: Any, cluster: Cluster, wait: float) -> Iterator[Any]:
    from distributed.comm import get_address_host_port

    if isinstance(cluster, str):
        try:
            get_address_host_port(cluster, strict=True)
        except ValueError:
            raise CampaignError(2, f"scheduler: {cluster}, expected an address like tcp://HOST:PORT") from None
    try:
        client = kind(cluster, timeout=wait, set_as_default=False)
    except (OSError, ValueError) as error:
        where = cluster if isinstance(cluster, str) else "of the cluster"
        said = str(error).strip().splitlines() or [type(error).__name__]
        raise CampaignError(3, f"scheduler {where}: not reached within {wait:g} s: {said[0]}") from None
    try:
        yield client
    finally:
        with contextlib.suppress(Exception):
            client.close(timeout=5)
