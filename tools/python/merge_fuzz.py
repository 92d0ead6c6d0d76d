#!/usr/bin/env python3
"""Joins reports of `decant fuzz` whose seeds do not overlap into one.

    merge_fuzz.py A.h5 B.h5 … --out ALL.h5

Of several counterexamples to one property of one backend the one with the smallest seed is kept.
Exit status: 0 joined, 2 bad input: seeds that overlap, reports of other revisions or tags.
"""

import argparse

from one_line import need_file, refuse, run_main
from package_source import campaign_package

campaign_package()
from decant.campaign.join import GROUPS, FuzzReport, JoinError  # noqa: E402


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("reports", nargs="+")
    parser.add_argument("--out", required=True)
    arguments = parser.parse_args()
    joined = FuzzReport()
    try:
        for path in arguments.reports:
            need_file(path, "a report of decant fuzz")
            joined.add(path)
    except JoinError as error:
        refuse(error)
    if joined.overlap():
        refuse(joined.overlap())
    joined.write(arguments.out)
    print(f"{joined.cases} cases of {len(arguments.reports)} reports, {joined.failed()} failures")


__all__ = ["GROUPS"]

if __name__ == "__main__":
    run_main(main)
