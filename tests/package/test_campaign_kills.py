"""What dies in a campaign loses nothing, and nothing counts twice: the report is that of one sequential run."""

import os
import random
import signal
import subprocess
import sys
import time

import pytest
from campaigns import ASKED, BLOCK, CASES, Cluster, blocks, client, commands_of, everything, finished, wait_for

import decant
from decant.campaign import CampaignError

pytest.importorskip("distributed")


def test_workers_killed_at_random_lose_nothing(tmp_path, sequential):
    seed, expected = sequential
    rng = random.Random(11)
    with Cluster() as cluster:
        process = client(tmp_path / "c", seed, "--scheduler", cluster.address, "--retries", "9")
        wait_for(lambda: blocks(tmp_path / "c"))
        for _ in range(2):
            time.sleep(rng.uniform(0, 0.4))
            cluster.kill_worker(rng.randrange(2))
            cluster.start_worker()
        # And one in the middle of a block.
        wait_for(lambda: any(cluster.kill_worker(k) for k in cluster.busy(seed)[:1]))
        cluster.start_worker()
        status, _, err = finished(process)
        assert status == 0, err
        assert "retr" in err
        wait_for(lambda: not commands_of(seed))
    assert everything(tmp_path / "c" / "report.h5") == expected


def test_killed_client_goes_on(tmp_path, sequential):
    seed, expected = sequential
    rng = random.Random(12)
    for _ in range(2):
        process = client(tmp_path / "c", seed, "--workers", "2")
        count = len(blocks(tmp_path / "c"))
        wait_for(lambda count=count: len(blocks(tmp_path / "c")) > count + 1)
        time.sleep(rng.uniform(0, 0.15))
        process.kill()
        process.wait()
        wait_for(lambda: not commands_of(seed))
    before = blocks(tmp_path / "c")
    assert 0 < len(before) < CASES // BLOCK
    status, _, err = finished(client(tmp_path / "c", seed, "--workers", "2", "--resume"))
    assert status == 0, err
    assert before.items() <= blocks(tmp_path / "c").items()
    assert everything(tmp_path / "c" / "report.h5") == expected


def test_killed_scheduler_is_waited_for(tmp_path, sequential):
    seed, expected = sequential
    with Cluster() as cluster:
        process = client(tmp_path / "c", seed, "--scheduler", cluster.address)
        wait_for(lambda: len(blocks(tmp_path / "c")) > 1)
        cluster.scheduler.kill()
        cluster.scheduler.wait()
        before = blocks(tmp_path / "c")
        for _ in range(2):
            cluster.kill_worker(0)
        cluster.start_scheduler()
        for _ in range(2):
            cluster.start_worker()
        status, _, err = finished(process)
    assert status == 0 and "the scheduler was lost" in err, err
    assert before.items() <= blocks(tmp_path / "c").items()
    assert everything(tmp_path / "c" / "report.h5") == expected


def test_interruption_within_a_destructor_is_not_lost():
    program = """
import os, signal, sys, time
from decant.campaign import command

class Dying:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(0.1)

def run(_):
    Dying()
    time.sleep(30)

command.run = run
sys.exit(command.main(["fuzz", "--backend", "hash", "--cases", "1", "--folder", "nowhere"]))
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=25)
    assert done.returncode == 128 + signal.SIGTERM and "interrupted" in done.stderr, done.stderr


def test_interrupted_client_keeps_what_it_has(tmp_path, sequential):
    seed, expected = sequential
    for number in (signal.SIGINT, signal.SIGTERM):
        process = client(tmp_path / "c", seed, "--workers", "1")
        count = len(blocks(tmp_path / "c"))
        wait_for(lambda count=count: len(blocks(tmp_path / "c")) > count)
        os.killpg(process.pid, number)
        status, _, err = finished(process)
        assert status == 128 + number and "interrupted" in err, err
        assert not commands_of(seed)
    assert finished(client(tmp_path / "c", seed))[0] == 0
    assert everything(tmp_path / "c" / "report.h5") == expected


def script(folder, text):
    """A stand-in for the command, in a folder for the PATH."""
    folder.mkdir()
    file = folder / "decant"
    file.write_text(f"#!/bin/sh\n{text}\n")
    file.chmod(0o755)
    return file


def test_worker_with_another_revision_is_refused(tmp_path, sequential, monkeypatch):
    script(tmp_path / "ours", f'exec "{decant.command.COMMAND}" "$@"')
    script(tmp_path / "theirs", f'"{decant.command.COMMAND}" "$@" | sed "s/\\(git_revision.: .\\)/\\1old-/"')
    monkeypatch.setenv("PATH", f"{tmp_path / 'ours'}:{os.environ['PATH']}")
    with Cluster() as cluster:
        for _ in range(2):
            cluster.kill_worker(0)
        cluster.start_worker(env={**os.environ, "PATH": f"{tmp_path / 'theirs'}:{os.environ['PATH']}"})
        with pytest.raises(CampaignError, match=r"worker tcp://.*git_revision: old-.*, expected ") as error:
            decant.campaign.fuzz(**ASKED, seed=sequential[0], folder=tmp_path / "c", cluster=cluster.address,
                                 decant="decant", quiet=True)  # fmt: skip
    assert error.value.status == 3 and not blocks(tmp_path / "c")


def test_blocks_that_cannot_run_are_named(tmp_path, sequential, capfd):
    seed = sequential[0]
    # The second block's command dies each time, the third one's device is absent, the fourth kills its worker.
    fake = script(tmp_path / "bin", f"""case "$*" in
      *"--seed {seed + BLOCK} "*) echo try >>"{tmp_path}/tries"; kill -SEGV $$ ;;
      *"--seed {seed + 2 * BLOCK} "*) echo try >>"{tmp_path}/absent"; echo "no device" >&2; exit 77 ;;
      *"--seed {seed + 3 * BLOCK} "*) echo try >>"{tmp_path}/killed"; kill -KILL $PPID ;;
    esac
    exec "{decant.command.COMMAND}" "$@" """)  # fmt: skip
    asked = {**ASKED, "cases": 6 * BLOCK, "seed": seed, "folder": tmp_path / "c", "quiet": True}
    with pytest.raises(CampaignError, match=f"3 of 6 blocks are missing: seeds-{seed + BLOCK}-") as error:
        decant.campaign.fuzz(**asked, decant=str(fake), retries=1, workers=2)
    assert error.value.status == 3
    said = capfd.readouterr().err
    assert "decant was ended by signal 11 on tcp://" in said
    assert "decant ended with status 77 on tcp://" in said and "no device" in said
    assert "2 workers died while they ran it, the last tcp://" in said
    assert len((tmp_path / "tries").read_text().split()) == 2
    assert len((tmp_path / "killed").read_text().split()) == 2
    assert len((tmp_path / "absent").read_text().split()) == 1
    result = decant.campaign.fuzz(**asked)
    assert result.passes and result.ran == 3
