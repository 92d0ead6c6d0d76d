"""What a campaign's folder holds, and how a file comes into it: whole, or not at all.

    campaign.json    what was asked, of which command
    lock             held by the client that runs
    blocks/NAME/     one block: block.json (digests of its files), stdout.txt, stderr.txt, what the command wrote
    report.h5, …     the whole, when all blocks are there
"""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import json
import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from .plan import MINIMISE, Plan

SCHEMA = 1


class CampaignError(RuntimeError):
    """What a campaign could not do: the exit status of the command (tools/README.md) and a line."""

    def __init__(self, status: int, message: str):
        self.status = status
        super().__init__(message)


def sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def write_whole(path: Path, content: bytes) -> None:
    """Writes aside, onto the disk, then renames."""
    aside = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        _write(aside, content)
        os.replace(aside, path)
    finally:
        aside.unlink(missing_ok=True)
    _sync(path.parent)


def _write(path: Path, content: bytes) -> None:
    try:
        with open(path, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:  # of a full disk it does not name the file
        raise OSError(error.errno, error.strerror, str(path)) from None


def _sync(folder: Path) -> None:
    """Makes names in a folder outlast a crash of the machine."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


class Folder:
    """One campaign's folder."""

    def __init__(self, path: str | Path):
        self.path = Path(path)
        self.blocks = self.path / "blocks"
        self.file = self.path / "campaign.json"

    @contextlib.contextmanager
    def locked(self) -> Iterator[None]:
        """Makes the folder and holds its lock. Raises CampaignError where another client holds it."""
        try:
            self.blocks.mkdir(parents=True, exist_ok=True)
            lock = open(self.path / "lock", "a")
        except OSError as error:
            raise CampaignError(2, f"{error.filename}: {error.strerror}, expected a folder to write to") from None
        with lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise CampaignError(2, f"{lock.name}: another client runs this campaign") from None
            for left in self.blocks.glob(".*"):
                shutil.rmtree(left, ignore_errors=True)
            yield

    def asked(self) -> dict[str, Any] | None:
        """campaign.json, or None where there is none. Raises CampaignError where it is none of this schema."""
        if not self.file.exists():
            if any(self.blocks.glob("[!.]*")):
                raise CampaignError(2, f"{self.file}: no such file, though {self.blocks} holds blocks")
            return None
        try:
            found = json.loads(self.file.read_text(encoding="utf-8"))
            schema = found["decant_campaign"]
        except (ValueError, KeyError, TypeError):
            raise CampaignError(2, f"{self.file}: no campaign.json, or cut off") from None
        if schema != SCHEMA:
            raise CampaignError(2, f"{self.file}: decant_campaign: {schema}, expected {SCHEMA}")
        return found

    def begin(self, wanted: dict[str, Any]) -> None:
        """Writes campaign.json, or compares it with what is wanted. Raises CampaignError naming what differs.

        A campaign without a block may still be asked otherwise: one that began with a slip of the pen.
        """
        wanted = json.loads(json.dumps({"decant_campaign": SCHEMA, **wanted}))
        found = self.asked()
        if found is None or not any(self.blocks.glob("[!.]*")):
            write_whole(self.file, (json.dumps(wanted, indent=1) + "\n").encode())
            return
        for key, value, expected in _differences(found, wanted):
            raise CampaignError(
                2, f"{self.file}: {key}: {json.dumps(value)}, expected {json.dumps(expected)} as asked now; "
                "a campaign goes on as it began, or takes another folder"
            )  # fmt: skip

    def keep(self, name: str, outcome: dict[str, Any], about: dict[str, Any]) -> None:
        """A block's files, as one rename. Raises CampaignError where they cannot be written."""
        aside = self.blocks / f".{name}.{os.getpid()}"
        try:
            shutil.rmtree(aside, ignore_errors=True)
            aside.mkdir()
            for file, content in outcome["files"].items():
                (aside / file).parent.mkdir(parents=True, exist_ok=True)
                _write(aside / file, content)
            digests = {file: sha256(content) for file, content in outcome["files"].items()}
            said = {key: outcome[key] for key in ("status", "said", "worker", "seconds")}
            _write(aside / "block.json", json.dumps({**about, **said, "sha256": digests}, indent=1).encode() + b"\n")
            for made in {path.parent for path in aside.rglob("*")}:
                _sync(made)
            shutil.rmtree(self.blocks / name, ignore_errors=True)
            os.rename(aside, self.blocks / name)
            _sync(self.blocks)
        except OSError as error:
            shutil.rmtree(aside, ignore_errors=True)
            raise CampaignError(3, f"{error.filename or aside}: {error.strerror}; block {name} is not kept") from None

    def block(self, name: str, about: dict[str, Any]) -> dict[str, Any]:
        """block.json of a block that is whole and as `about` says. Raises ValueError saying what is wrong with it."""
        file = self.blocks / name / "block.json"
        try:
            found = json.loads(file.read_text(encoding="utf-8"))
            digests = dict(found["sha256"])
            int(found["status"])
        except (OSError, ValueError, KeyError, TypeError):
            raise ValueError(f"{file}: no block.json, or cut off") from None
        for key, value, expected in _differences({key: found.get(key) for key in about}, about):
            raise ValueError(f"{file}: {key}: {json.dumps(value)}, expected {json.dumps(expected)}")
        for part, digest in digests.items():
            path = self.blocks / name / part
            here = sha256(path.read_bytes()) if path.is_file() else "no such file"
            if here != digest:
                raise ValueError(f"{path}: sha256: {here}, expected {digest}")
        return found

    def kept(self, plan: Plan, about: dict[str, Any]) -> tuple[dict[str, dict[str, Any]], list[str]]:
        """Blocks of the plan that are there and whole, and what is wrong with those that are not."""
        there = {path.name for path in self.blocks.glob("[!.]*")}
        whole, wrong = {}, []
        for block in plan.blocks:
            if block.name in there:
                try:
                    whole[block.name] = self.block(block.name, {**about, **block.identity()})
                except ValueError as error:
                    wrong.append(f"{error}; the block is run again")
        return whole, wrong

    def foreign(self, plan: Plan) -> list[str]:
        """What else is in blocks/."""
        names = {block.name for block in plan.blocks}
        found = sorted(path.name for path in self.blocks.glob("[!.]*"))
        return [
            f"{self.blocks / name}: of no block of this campaign; left alone" for name in found
            if name not in names and not (plan.verb == "fuzz" and name.startswith(MINIMISE))
        ]  # fmt: skip


def _differences(found: Any, wanted: Any, key: str = "") -> Iterator[tuple[str, Any, Any]]:
    if isinstance(found, dict) and isinstance(wanted, dict):
        for name in [*wanted, *(name for name in found if name not in wanted)]:
            yield from _differences(found.get(name), wanted.get(name), f"{key}.{name}" if key else name)
    elif found != wanted:
        yield key, found, wanted
