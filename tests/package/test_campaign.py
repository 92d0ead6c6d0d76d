"""Campaigns: the whole is what one run reports, however it is cut; what does not fit, or is damaged, is not taken."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import pytest
from campaigns import ASKED, BLOCK, CASES, everything

import decant
from decant.campaign import CampaignError
from decant.campaign.folder import Folder

pytest.importorskip("distributed")

PORTS = Path(__file__).parent / "ports.py"


def test_local_campaign_is_one_report(tmp_path, sequential, capfd):
    seed, expected = sequential
    result = decant.campaign.fuzz(**ASKED, seed=seed, folder=tmp_path / "c", workers=2)
    result.require()
    assert everything(result.report) == expected and result.ran == result.blocks == CASES // BLOCK
    assert f"{CASES}/{CASES}" in capfd.readouterr().err
    again = decant.campaign.fuzz(**{**ASKED, "block": None}, seed=seed, folder=tmp_path / "c", quiet=True)
    assert again.ran == 0 and everything(again.report) == expected
    assert capfd.readouterr().err == ""


def test_what_is_right_step_by_step_is_counted_once(tmp_path):
    """Seed 3003940: a particle between a wall and the floor; see Campaign.CountsApartWhatIsRightStepByStep."""
    asked = {**ASKED, "properties": ["containment"], "seed": 3003938, "cases": 6, "block": 2}
    result = decant.campaign.fuzz(**asked, folder=tmp_path / "c", workers=2, quiet=True)
    result.require()
    with h5py.File(result.report) as report:
        rows = report["statistics"]
        assert rows["stepwise"][:].tolist() == [1] and rows["stepwise_seed"][:].tolist() == [3003940]
        assert rows["asked"][0] == 1 + sum(int(rows[f"score_bin_{k:02}"][0]) for k in range(12))
    text = (tmp_path / "c" / "report.txt").read_text()
    assert " stepwise " in text and text.rstrip().endswith("First seeds: containment hash 3003940")


@pytest.fixture(scope="module")
def done(tmp_path_factory, sequential):
    """A small campaign that is done."""
    folder = tmp_path_factory.mktemp("done") / "c"
    asked = {**ASKED, "seed": sequential[0], "cases": 16, "block": 4}
    decant.campaign.fuzz(**asked, folder=folder, quiet=True)
    return folder, asked


def test_damaged_blocks_are_run_again(tmp_path, done, capfd):
    folder, asked = shutil.copytree(done[0], tmp_path / "c"), done[1]
    names = sorted(path.name for path in (folder / "blocks").iterdir())
    expected = everything(folder / "report.h5")
    cut, flipped, bare = (folder / "blocks" / name / "report.h5" for name in names[:3])
    os.truncate(cut, cut.stat().st_size // 2)
    content = bytearray(flipped.read_bytes())
    content[len(content) // 2] ^= 1
    flipped.write_bytes(content)
    (bare.parent / "block.json").write_text("{")
    (folder / "blocks" / ".seeds-left-by-the-dead").mkdir()
    (folder / "blocks" / "notes.txt").write_text("mine")
    shutil.copytree(folder / "blocks" / names[3], folder / "blocks" / "seeds-1-4")
    result = decant.campaign.fuzz(**asked, folder=folder, quiet=True)
    assert result.ran == 3 and everything(result.report) == expected
    said = capfd.readouterr().err
    assert f"{names[0]}/report.h5: sha256" in said and f"{names[1]}/report.h5: sha256" in said
    assert f"{names[2]}/block.json: no block.json, or cut off; the block is run again" in said
    assert "notes.txt: of no block" in said and "seeds-1-4: of no block" in said
    assert (folder / "blocks" / "notes.txt").exists() and not list((folder / "blocks").glob(".*"))


def test_block_of_other_seeds_is_not_taken(tmp_path, done):
    folder, asked = shutil.copytree(done[0], tmp_path / "c"), done[1]
    one, other = sorted((folder / "blocks").iterdir())[:2]
    expected = everything(folder / "report.h5")
    shutil.rmtree(one)
    shutil.copytree(other, one)
    result = decant.campaign.fuzz(**asked, folder=folder, quiet=True)
    assert result.ran == 1 and everything(result.report) == expected
    # A manifest that lies is found by the seeds of the report.
    shutil.copy(other / "report.h5", one / "report.h5")
    manifest = json.loads((one / "block.json").read_text())
    manifest["sha256"] = json.loads((other / "block.json").read_text())["sha256"]
    shutil.copy(other / "stdout.txt", one / "stdout.txt")
    (one / "block.json").write_text(json.dumps(manifest))
    with pytest.raises(CampaignError, match="seeds .* are in no report") as error:
        decant.campaign.fuzz(**asked, folder=folder, quiet=True)
    assert error.value.status == 3


def test_what_does_not_fit_is_refused(tmp_path, done, monkeypatch):
    folder, asked = shutil.copytree(done[0], tmp_path / "c"), done[1]

    def refused(message, status=2, **change):
        with pytest.raises(CampaignError, match=message) as error:
            decant.campaign.fuzz(**{**asked, "folder": folder, "quiet": True, **change})
        assert error.value.status == status

    refused(r"campaign.json: asked.cases: 16, expected 17 as asked now", cases=17)
    refused(r"campaign.json: asked.backend: \"hash\", expected \"list\"", backend="list")
    refused(r"campaign.json: block_cases: 4, expected 5", block=5)
    refused("cases: 0, expected 1 to", cases=0)
    refused("block: 1, expected 2 to", folder=tmp_path / "new", cases=1_000_001, block=1)
    refused("backend: <class 'object'>, expected a name", backend=object)
    refused("decant: /no/decant: no command here", decant="/no/decant")
    refused("workers: 0, expected 1 to", folder=tmp_path / "new", workers=0)
    refused("must be one of reference, brute", folder=tmp_path / "slip", backend="hsh")
    refused("scheduler tcp://127.0.0.1:1: not reached within 1 s", 3, folder=tmp_path / "new", wait=1,
            cluster="tcp://127.0.0.1:1")  # fmt: skip
    with Folder(folder).locked():
        refused("lock: another client runs this campaign")
    file = folder / "campaign.json"
    file.write_text(file.read_text().replace('"git_revision": "', '"git_revision": "other-'))
    refused('campaign.json: git_revision: "other-')
    file.write_text(file.read_text()[:40])
    refused("campaign.json: no campaign.json, or cut off")
    file.unlink()
    refused("campaign.json: no such file, though")
    monkeypatch.setitem(sys.modules, "distributed", None)
    refused(r"distributed is not installed here: pip install 'decant\[campaign\]'", folder=tmp_path / "new")


def test_failing_campaign_has_every_seed_and_one_counterexample(tmp_path):
    backend = f"python:{PORTS}:Faulty:fault=sign"
    found = decant.campaign.fuzz(backend=backend, properties=["fields"], cases=6, block=3, folder=tmp_path / "c",
                                 quiet=True)  # fmt: skip
    assert found.status == 1
    with pytest.raises(AssertionError, match="fail: fields of"):
        found.require()
    file = tmp_path / "sequential.h5"
    words = ["fuzz", "--backend", backend, "--property", "fields", "--cases", "6", "--threads", "1"]
    words += ["--failures", str(tmp_path / "found"), "--report", str(file), "--quiet"]
    decant.command.run(words, passes=(1,))
    written = ("seconds", "device", "file", "tries")
    assert everything(found.report, written) == everything(file, written)
    with h5py.File(found.report) as report:
        (fixture,) = (tmp_path / "c" / name.decode() for name in report["counterexamples/file"])
    assert not decant.conform(fixture, backend=backend, checks="fields").passes


def test_drift_is_the_same_however_it_is_cut(tmp_path):
    asked = {"intervals": [1, 3], "skins": [0, 0.1], "window": 4}
    words = ["drift", "pour-4k-splash", "--untimed", "--window", "4", "--intervals", "1,3", "--skins", "0,0.1"]
    decant.command.run([*words, "--report", str(tmp_path / "one.h5"), "--quiet"])
    for split in ("interval", "skin"):
        found = decant.campaign.drift("pour-4k-splash", **asked, timed=False, split=split, folder=tmp_path / split,
                                      quiet=True)  # fmt: skip
        without = ("seconds", "device")
        assert everything(found.report, without) == everything(tmp_path / "one.h5", without)


def test_study_keeps_what_each_line_wrote(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    finds = f"import sys\nsys.path.insert(0, {str(PORTS.parent)!r})\n"
    (tmp_path / "port.py").write_text(f"{finds}from ports import Faulty\n")
    lines = ["# conformance", "conform hostile-bowl --backend hash --executor host --report out/report.h5 --quiet",
             "conform hostile-bowl --backend python:port.py:Faulty:fault=sign --check fields --report r.h5",
             "conform no-such-recording"]  # fmt: skip
    with pytest.raises(CampaignError, match="1 of 3 blocks are missing: 0003-conform") as error:
        decant.campaign.study(lines, folder="c", quiet=True)
    assert error.value.status == 2
    with pytest.raises(CampaignError, match="line 1: --report: /out.h5, expected a relative path"):
        decant.campaign.study(["info --report /out.h5"], folder="d")
    rows = json.loads(Path("c/index.json").read_text())["rows"]
    assert [row["status"] for row in rows] == [0, 1, None] and "pass" in rows[0]["said"]
    assert decant.read_report("c/blocks/0001-conform/out/report.h5").passes
    assert not decant.read_report("c/blocks/0002-conform/r.h5").passes


def test_validation_is_one_report(tmp_path):
    words = ["validate", "free-fall", "--resolution", "5,6", "--backend", "hash", "--executor", "host", "--quiet"]
    decant.command.run([*words, "--report", str(tmp_path / "one.h5")], passes=(0, 1))
    found = decant.campaign.validate("free-fall", backend="hash", executor="host", resolutions=[5, 6],
                                     folder=tmp_path / "c", quiet=True)  # fmt: skip
    without = ("solver_seconds", "device")
    assert everything(found.report, without) == everything(tmp_path / "one.h5", without)


def test_one_worker_per_gpu_sees_it_alone(monkeypatch):
    from distributed import Client

    from decant.campaign.cluster import local_cluster, local_workers, visible_gpus

    monkeypatch.setenv("CUDA_VISIBLE_DEVICES", "4,GPU-aa, 7")
    assert visible_gpus(2) == ["4", "GPU-aa"] and local_workers(None, 3, 2) == (2, 3)
    with pytest.raises(CampaignError, match="gpus: 4, expected at most 3"):
        visible_gpus(4)
    with local_cluster(2, 2, retries=1) as cluster, Client(cluster, set_as_default=False) as there:
        there.wait_for_workers(2, timeout=30)
        assert set(there.run(os.getenv, "CUDA_VISIBLE_DEVICES").values()) == {"4", "GPU-aa"}


def test_slurm_example_makes_a_job_script():
    pytest.importorskip("dask_jobqueue")
    import slurm_campaign

    with slurm_campaign.SLURMCluster(**slurm_campaign.JOB) as cluster:
        text = cluster.job_script()
    for line in ("-p gpu", "--gpus-per-task=1", "--cpus-per-task=8", "-t 02:00:00"):
        assert f"#SBATCH {line}" in text.splitlines(), text
    assert "--nthreads 1" in text and "--lifetime 110m" in text


def test_import_needs_no_dask():
    words = "import decant, sys; sys.exit('dask' in sys.modules or 'distributed' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", words]).returncode == 0


def test_progress_says_how_far_it_is():
    from decant.campaign.progress import Progress

    progress = Progress("cases", 1000, 200, quiet=False)
    progress.done = 600
    progress.begin -= 99.99
    for event in ({"action": "add-worker", "worker": "a"}, {"action": "add-worker", "worker": "b"},
                  {"action": "remove-worker", "worker": "a"}):  # fmt: skip
        progress.note_worker((0.0, event))
    for _ in range(2):
        progress.note((0.0, {"started": "seeds-1-8"}))
    assert progress.text() == "cases 600/1 000, 4 per second, 1 min 40 s left, 1 worker, 1 retry"
