#!/usr/bin/env python3
"""Joins reports of `decant fuzz` whose seeds do not overlap into one.

    merge_fuzz.py A.h5 B.h5 … --out ALL.h5

Exit status: 0 joined, 2 bad input: seeds that overlap, reports of other revisions or tags.
"""

import argparse

import h5py
import numpy as np

from one_line import open_hdf5, refuse, run_main

# Of a schema: coverage tags, statistics per property and backend, counterexamples.
GROUPS = {1: ("classes", "tallies", "findings"), 2: ("tags", "statistics", "counterexamples")}


def read(path):
    file = open_hdf5(path, ["decant_fuzz"], "a report of decant fuzz")
    if int(file.attrs["decant_fuzz"]) not in GROUPS:
        refuse(f"{path}: schema {file.attrs['decant_fuzz']}, not {' or '.join(map(str, GROUPS))}")
    return file


def check_seeds(files):
    ranges = sorted((f.attrs["first_seed"], f.attrs["cases"], f.filename) for f in files)
    for (first, cases, name), (following, _, other) in zip(ranges, ranges[1:]):
        if first + cases > following:
            refuse(f"{name} and {other} both have seed {following}")
    return ranges[0][0]


def joined_statistics(files, statistics):
    joined = {}
    for file in files:
        group = file[statistics]
        for k in range(len(group["property"])):
            row = {name: group[name][k] for name in group}
            key = (row["property"], row["backend"])
            known = joined.setdefault(key, dict(row, asked=0, failed=0, worst=-1.0,
                                                 **{n: 0 for n in group if n.startswith("score_")}))
            for name in group:
                if name in ("asked", "failed") or name.startswith("score_"):
                    known[name] += row[name]
            if row["worst"] > known["worst"]:
                known.update({n: row[n] for n in ("worst", "worst_seed", "worst_field")})
    return [joined[key] for key in sorted(joined)]


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("reports", nargs="+")
    parser.add_argument("--out", required=True)
    arguments = parser.parse_args()
    files = [read(path) for path in arguments.reports]
    first = check_seeds(files)
    tags, statistics, counterexamples = GROUPS[int(files[0].attrs["decant_fuzz"])]
    for file in files[1:]:
        if file["provenance"].attrs["git_revision"] != files[0]["provenance"].attrs["git_revision"]:
            refuse(f"{file.filename}: another revision than {files[0].filename}")
        if list(file[f"{tags}/name"]) != list(files[0][f"{tags}/name"]):
            refuse(f"{file.filename}: other tags than {files[0].filename}")
    with h5py.File(arguments.out, "w", libver="v108") as out:
        for name in ("decant_fuzz", "executor", "device"):
            out.attrs[name] = files[0].attrs[name]
        out.attrs["first_seed"] = np.int64(first)
        for name in ("cases", "undecidable", "seconds"):
            out.attrs[name] = sum(f.attrs[name] for f in files)
        files[0].copy("provenance", out)
        files[0].copy(tags, out)
        out[f"{tags}/cases"][:] = sum(f[f"{tags}/cases"][:] for f in files)
        rows = joined_statistics(files, statistics)
        for name, like in files[0][statistics].items():
            data = out.create_dataset(f"{statistics}/{name}",
                                      data=np.array([row[name] for row in rows]))
            data.attrs.update(like.attrs)
        for name, like in files[0][counterexamples].items():
            parts = [f[counterexamples][name][:] for f in files if len(f[counterexamples][name])]
            data = out.create_dataset(f"{counterexamples}/{name}",
                                      data=np.concatenate(parts) if parts else like[:])
            data.attrs.update(like.attrs)
        failed = int(np.sum(out[f"{statistics}/failed"]))
        print(f"{out.attrs['cases']} cases of {len(files)} reports, {failed} failures")


if __name__ == "__main__":
    run_main(main)
