#!/usr/bin/env python3
"""Joins reports of `decant fuzz` whose seeds do not overlap into one.

    merge_fuzz.py A.h5 B.h5 … --out ALL.h5

Exit status: 0 joined, 2 bad input: seeds that overlap, reports of other revisions or classes.
"""

import argparse
import sys

import h5py
import numpy as np


def refuse(text):
    print(f"merge_fuzz.py: {text}", file=sys.stderr)
    sys.exit(2)


def read(path):
    try:
        file = h5py.File(path)
    except OSError as error:
        refuse(f"{path}: {error}")
    if "decant_fuzz" not in file.attrs:
        refuse(f"{path}: not a report of decant fuzz")
    return file


def check_seeds(files):
    ranges = sorted((f.attrs["first_seed"], f.attrs["cases"], f.filename) for f in files)
    for (first, cases, name), (following, _, other) in zip(ranges, ranges[1:]):
        if first + cases > following:
            refuse(f"{name} and {other} both have seed {following}")
    return ranges[0][0]


def joined_tallies(files):
    tallies = {}
    for file in files:
        group = file["tallies"]
        for k in range(len(group["property"])):
            row = {name: group[name][k] for name in group}
            key = (row["property"], row["backend"])
            known = tallies.setdefault(key, dict(row, asked=0, failed=0, worst=-1.0,
                                                 **{n: 0 for n in group if n.startswith("score_")}))
            for name in group:
                if name in ("asked", "failed") or name.startswith("score_"):
                    known[name] += row[name]
            if row["worst"] > known["worst"]:
                known.update({n: row[n] for n in ("worst", "worst_seed", "worst_field")})
    return [tallies[key] for key in sorted(tallies)]


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("reports", nargs="+")
    parser.add_argument("--out", required=True)
    arguments = parser.parse_args()
    files = [read(path) for path in arguments.reports]
    first = check_seeds(files)
    for file in files[1:]:
        if file["provenance"].attrs["git_revision"] != files[0]["provenance"].attrs["git_revision"]:
            refuse(f"{file.filename}: another revision than {files[0].filename}")
        if list(file["classes/name"]) != list(files[0]["classes/name"]):
            refuse(f"{file.filename}: other classes than {files[0].filename}")
    with h5py.File(arguments.out, "w", libver="v108") as out:
        for name in ("decant_fuzz", "executor", "device"):
            out.attrs[name] = files[0].attrs[name]
        out.attrs["first_seed"] = np.int64(first)
        for name in ("cases", "undecidable", "seconds"):
            out.attrs[name] = sum(f.attrs[name] for f in files)
        files[0].copy("provenance", out)
        files[0].copy("classes", out)
        out["classes/cases"][:] = sum(f["classes/cases"][:] for f in files)
        rows = joined_tallies(files)
        for name, like in files[0]["tallies"].items():
            data = out.create_dataset(f"tallies/{name}",
                                      data=np.array([row[name] for row in rows]))
            data.attrs.update(like.attrs)
        for name, like in files[0]["findings"].items():
            parts = [f["findings"][name][:] for f in files if len(f["findings"][name])]
            data = out.create_dataset(f"findings/{name}",
                                      data=np.concatenate(parts) if parts else like[:])
            data.attrs.update(like.attrs)
        failed = int(np.sum(out["tallies/failed"]))
        print(f"{out.attrs['cases']} problems of {len(files)} reports, {failed} failures")


if __name__ == "__main__":
    main()
