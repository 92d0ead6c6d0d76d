"""What stands in a campaign's folder at its end: one report of all blocks, its text, counterexamples, an index."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from .folder import CampaignError, Folder, write_whole
from .join import DriftReport, FuzzReport, JoinError, Report, ValidationReport, missing_seeds
from .plan import COUNTEREXAMPLES, REPORT, Block, Plan, minimising_block
from .run import Done


def report_of(folder: Folder, plan: Plan, about: dict[str, str]) -> Report:
    """The reports of all blocks of a plan, joined. Raises CampaignError naming what does not fit."""
    made: Report
    if plan.verb == "fuzz":
        made = FuzzReport()
    elif plan.verb == "drift":
        made = DriftReport(plan.asked["intervals"], plan.asked["skins"])
    else:
        made = ValidationReport()
    try:
        for block in plan.blocks:
            made.add(folder.blocks / block.name / REPORT)
            if made.revision != about["git_revision"]:
                raise JoinError(f"{made.first}: git_revision: {made.revision}, expected {about['git_revision']}")
        if isinstance(made, FuzzReport):
            wrong = missing_seeds(made.ranges, plan.asked["seed"], plan.asked["cases"])
            if wrong:
                raise JoinError(wrong)
    except JoinError as error:
        raise CampaignError(3, str(error)) from None
    return made


def minimising_plan(plan: Plan, report: FuzzReport) -> Plan:
    """What minimises one counterexample to each property of each backend that failed."""
    blocks = [
        minimising_block(row["backend"].decode(), plan.asked["executor"], row["property"].decode(), int(row["seed"]))
        for row in report.found.values()
    ]
    return Plan("fuzz", plan.asked, tuple(blocks), "counterexamples", plan.inputs)


def write_report(folder: Folder, report: Report) -> Path:
    """report.h5, aside first. Raises CampaignError where it cannot be written."""
    file = folder.path / REPORT
    try:
        with tempfile.TemporaryDirectory(dir=folder.path, prefix=".report-") as aside:
            report.write(Path(aside) / REPORT)
            with open(Path(aside) / REPORT, "rb") as made:
                os.fsync(made.fileno())
            os.replace(Path(aside) / REPORT, file)
    except OSError as error:
        raise CampaignError(3, f"{file}: {error.strerror or error}") from None
    return file


def collect_counterexamples(folder: Folder, plan: Plan, minimised: Plan, report: FuzzReport) -> None:
    """counterexamples/: the fixtures that the report names, with their scenes."""
    place = folder.path / COUNTEREXAMPLES
    shutil.rmtree(place, ignore_errors=True)
    # Minimised ones last: they replace those of the same name.
    for block in (*plan.blocks, *minimised.blocks):
        for row in report.found.values():
            name = Path(row["file"].decode()).name
            for file in (name, Path(name).with_suffix(".json").name):
                source = folder.blocks / block.name / COUNTEREXAMPLES / file
                if source.is_file():
                    place.mkdir(exist_ok=True)
                    write_whole(place / file, source.read_bytes())


def fuzz_text(report: FuzzReport) -> str:
    """Table for people."""
    first = min(begin for begin, _, _ in report.ranges)
    lines = [f"{report.cases} cases of seeds {first} to {first + report.cases - 1} in {len(report.ranges)} blocks; "
             f"{report.undecidable} with pairs so near H that fp32 cannot tell who is a neighbor", "",
             f"{'property':14} {'backend':24} {'asked':>9} {'failed':>7} {'stepwise':>8} {'worst':>8} "
             f"{'seed':>10}  of"]  # fmt: skip
    for key in sorted(report.rows):
        row = report.rows[key]
        text = f"{row['property'].decode():14} {row['backend'].decode():24} {row['asked']:>9} {row['failed']:>7}"
        text += f" {row.get('stepwise', '-'):>8}"
        text += f" {row['worst']:>8.3f} {row['worst_seed']:>10}  {row['worst_field'].decode()}"
        lines.append(text.rstrip())
    stepwise = [
        f"{row['property'].decode()} {row['backend'].decode()} {row['stepwise_seed']}"
        for _, row in sorted(report.rows.items())
        if row.get("stepwise")
    ]
    if stepwise:
        lines += [
            "",
            "stepwise: of those asked, runs that end outside their bound and hold all the same, since each substep is",
            f"right from the state before; not in worst. First seeds: {', '.join(stepwise)}",
        ]
    for row in sorted(report.found.values(), key=lambda r: (r["seed"], r["backend"], r["property"])):
        lines += ["", f"fail: {row['property'].decode()} of {row['backend'].decode()}, seed {row['seed']}: "
                  f"{row['minimised_particles']} of {row['found_particles']} particles left",
                  f"  {row['reason'].decode()}", f"  decant conform {row['file'].decode()}"]  # fmt: skip
    return "\n".join(lines) + "\n"


def joined_text(folder: Folder, blocks: Sequence[Block]) -> str:
    """What the blocks printed, in their order."""
    return "".join(f"{(folder.blocks / b.name / 'stdout.txt').read_text(encoding='utf-8')}\n" for b in blocks)


def write_index(folder: Folder, plan: Plan, done: Done) -> str:
    """index.json and index.txt of a study: a row per line, with its status, last line, files and seconds."""
    rows = []
    for line, block in zip(plan.asked["lines"], plan.blocks):
        kept = done.kept.get(block.name)
        row: dict[str, Any] = {"block": block.name, "line": line}
        if kept:
            row |= {"status": kept["status"], "said": kept["said"], "seconds": round(kept["seconds"], 3),
                    "files": [f"blocks/{block.name}/{file}" for file in kept["sha256"]]}  # fmt: skip
        else:
            row |= {"status": None, "said": done.failed.get(block.name, "not run"), "seconds": None, "files": []}
        rows.append(row)
    wide = max(len(row["block"]) for row in rows)
    text = f"{'block':{wide}}  status  seconds  said\n"
    for row in rows:
        status = "-" if row["status"] is None else row["status"]
        seconds = "-" if row["seconds"] is None else f"{row['seconds']:.1f}"
        text += f"{row['block']:{wide}}  {status:>6}  {seconds:>7}  {row['said']}\n"
    _keep(folder, "index.json", json.dumps({"decant_campaign_index": 1, "rows": rows}, indent=1) + "\n")
    _keep(folder, "index.txt", text)
    return text


def write_text(folder: Folder, text: str) -> None:
    """report.txt."""
    _keep(folder, "report.txt", text)


def _keep(folder: Folder, name: str, text: str) -> None:
    try:
        write_whole(folder.path / name, text.encode())
    except OSError as error:
        raise CampaignError(3, f"{folder.path / name}: {error.strerror}") from None


