"""The command line of campaigns: decant campaign fuzz|drift|validate|study … --folder FOLDER."""

from __future__ import annotations

import argparse
import signal
import sys
from collections.abc import Callable
from pathlib import Path

from . import CampaignError, Result, drift, fuzz, study, validate

STATUS = """
Exit status: 0 all hold, 1 something does not conform, 2 bad input, 3 something could not run (what lacks is named), 130
after Ctrl-C (143: SIGTERM). Blocks that are done are kept in FOLDER, and the same command again goes on with the
others. A block whose worker dies, or whose command is ended by a signal or with status 3, is tried again, --retries
times; bad input (2) and an absent device (77) are not.
"""


def _listed(kind: type) -> Callable[[str], list]:
    def values(text: str) -> list:
        return [kind(part) for part in text.split(",") if part]

    values.__name__ = f"{kind.__name__} list"  # in argparse's message
    return values


def _shared(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--folder", required=True, type=Path, help="of the campaign; one that is there goes on")
    parser.add_argument("--resume", action="store_true", help="fail where there is no campaign in FOLDER to go on with")
    where = parser.add_argument_group("where it runs")
    where.add_argument("--scheduler", metavar="ADDRESS", dest="cluster",
                       help="of a running Dask cluster; default: processes of this machine")
    where.add_argument("--workers", type=int, help="processes of this machine; default: one for --threads cores")
    where.add_argument("--threads", type=int, help="of each block; default: cores / workers, with --scheduler 1")
    where.add_argument("--gpus", type=int, default=0, help="a process of this machine for each of so many GPUs")
    where.add_argument("--retries", type=int, default=3, help="of a block whose worker or command dies (default 3)")
    where.add_argument("--wait", type=float, default=60, help="seconds for a scheduler that is not there (default 60)")
    where.add_argument("--decant", metavar="PATH", help="the command, as workers find it; default: the package's, "
                       "then decant on the PATH")  # fmt: skip
    parser.add_argument("--quiet", action="store_true", help="no progress on standard error")


def _solver(parser: argparse.ArgumentParser, backend: str | None) -> None:
    parser.add_argument("--backend", default=backend, required=backend is None, help="as decant takes it; files below "
                        "the present folder are sent to workers")  # fmt: skip
    parser.add_argument("--executor", default="auto", help="cuda, host or auto (default)")


def parser_of(prog: str) -> argparse.ArgumentParser:
    """The command line's."""
    parser = argparse.ArgumentParser(prog=prog, description=__doc__, epilog=STATUS)
    verbs = parser.add_subparsers(dest="verb", required=True)

    def verb(name: str, text: str) -> argparse.ArgumentParser:
        made = verbs.add_parser(name, help=text, description=text, epilog=STATUS)
        _shared(made)
        return made

    made = verb("fuzz", "property-based tests, in blocks of consecutive seeds")
    _solver(made, "brute,hash,list")
    made.add_argument("--cases", type=int, required=True, help="how many seeds")
    made.add_argument("--seed", type=int, default=1, help="the first (default 1)")
    made.add_argument("--property", type=_listed(str), default=[], dest="properties", help="by name, several by commas")
    made.add_argument("--block", type=int, help="seeds per block (default 200)")
    made.add_argument("--no-minimise", action="store_false", dest="minimise", help="keep counterexamples as found")

    made = verb("drift", "what stale neighbor lists miss, in a block per input, interval or skin")
    _solver(made, "list")
    made.add_argument("inputs", nargs="+", metavar="INPUT", help="recordings and scenes (*.json)")
    made.add_argument("--intervals", type=_listed(int), default=[1, 2, 5, 10, 20, 50], help="substeps, by commas")
    made.add_argument("--skins", type=_listed(float), default=[0, 0.05, 0.1, 0.2], help="shares of H, by commas")
    made.add_argument("--window", type=int, help="substeps run from each state")
    made.add_argument("--samples", type=int, help="moments of a scene at which lists are compared")
    made.add_argument("--full-run", action="store_true", help="of a scene: with every list from end to end")
    made.add_argument("--untimed", action="store_false", dest="timed", help="lists are compared, not run")
    made.add_argument("--split", default="input", help="input (default), interval or skin: what a block has one of")

    made = verb("validate", "analytic solutions and experiments, in a block per case")
    _solver(made, "reference")
    made.add_argument("cases", nargs="+", metavar="CASE", help="of decant validate --list")
    made.add_argument("--resolution", type=_listed(int), default=[], dest="resolutions", help="particles, by commas")
    made.add_argument("--quick", action="store_true", help="one coarse resolution")

    made = verb("study", "lines of the command, in a block each")
    made.add_argument("lines", metavar="FILE", help="a line per call, without the word decant; - is standard input")
    made.add_argument("--send", action="append", default=[], metavar="FILE", help="further file that lines need")
    return parser


def run(arguments: argparse.Namespace) -> Result:
    """Runs what was asked. Raises CampaignError."""
    given = vars(arguments)
    verb = given.pop("verb")
    if given.pop("resume") and not (arguments.folder / "campaign.json").is_file():
        raise CampaignError(2, f"{arguments.folder / 'campaign.json'}: no such file, expected a campaign to go on with")
    if verb == "fuzz":
        return fuzz(**given)
    if verb == "drift":
        return drift(*given.pop("inputs"), **given)
    if verb == "validate":
        return validate(*given.pop("cases"), **given)
    name = given.pop("lines")
    try:
        text = sys.stdin.read() if name == "-" else Path(name).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise CampaignError(2, f"{name}: {getattr(error, 'strerror', None) or 'no text'}") from None
    return study(text.splitlines(), **given)


def main(words: list[str] | None = None, prog: str = "decant campaign") -> int:
    """Runs the command line and returns its exit status."""
    parser = parser_of(prog)
    arguments = parser.parse_args(words)
    caught = []

    def stop(number, frame):
        if number != signal.SIGALRM:
            caught.append(number)
        while frame is not None:
            if frame.f_code.co_name == "__del__":  # what is raised there is ignored
                signal.setitimer(signal.ITIMER_REAL, 0.05)
                return
            frame = frame.f_back
        raise KeyboardInterrupt

    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGALRM):
        signal.signal(number, stop)
    try:
        result = run(arguments)
    except CampaignError as error:
        print(f"{prog}: {error}", file=sys.stderr)
        return error.status
    except KeyboardInterrupt:
        print(f"{prog}: interrupted; the same command again goes on", file=sys.stderr)
        return 128 + (caught[0] if caught else signal.SIGINT)
    print(result.text, end="")
    return result.status


if __name__ == "__main__":
    sys.exit(main())
