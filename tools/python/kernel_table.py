#!/usr/bin/env python3
"""Prints the kernels of ncu's raw CSV (ci/gpu leaves kernels.csv) as a table, one line a kernel."""

import argparse
import csv
import re

from one_line import need_file, refuse, run_main

COLUMNS = [  # heading, metric or two whose quotient it is, scale
    ("us", "gpu__time_duration.sum", 1e-3),
    ("registers", "launch__registers_per_thread", 1),
    ("occupancy %", "sm__warps_active.avg.pct_of_peak_sustained_active", 1),
    ("M instr.", "smsp__inst_executed.sum", 1e-6),
    ("issue %", "smsp__issue_active.avg.pct_of_peak_sustained_active", 1),
    ("lanes of 32", "smsp__thread_inst_executed_per_inst_executed.ratio", 1),
    ("L1 hit %", "l1tex__t_sector_hit_rate.pct", 1),
    ("M L2 sectors", "lts__t_sectors.sum", 1e-6),
    ("DRAM MB", "dram__bytes.sum", 1e-6),
    ("waves/shared", ("l1tex__data_pipe_lsu_wavefronts_mem_shared.sum", "smsp__sass_inst_executed_op_shared.sum"), 1),
]


def short(name):
    name = re.sub(r"decant::|gpu::|cuda::|unnamed>::|void |\(int\)|\(bool\)", "", name)
    return re.sub(r"\(.*", "", name)[:66]


def figure(header, row, metric):
    if isinstance(metric, tuple):
        above, below = (figure(header, row, part) for part in metric)
        return above / below if below else 0.0
    return float(row[header.index(metric)].replace(",", ""))


def last_of_each(path):
    """Figures by kernel, of its last launch. ValueError where a column is missing or holds no number."""
    header, last = None, {}
    with open(path, newline="", encoding="utf-8") as file:
        for row in csv.reader(file):
            if "Kernel Name" in row:
                header = row
            elif header and len(row) == len(header) and row[header.index("ID")].isdigit():
                name = short(row[header.index("Kernel Name")])
                last[name] = [figure(header, row, metric) * scale for _, metric, scale in COLUMNS]
    return last


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("csv", help="ncu --csv --page raw")
    arguments = parser.parse_args()
    need_file(arguments.csv, "ncu's raw CSV")
    try:
        last = last_of_each(arguments.csv)
    except (ValueError, csv.Error) as error:
        refuse(f"{arguments.csv}: not ncu's raw CSV: {error}")
    if not last:
        refuse(f"{arguments.csv}: no kernels of ncu's raw page")
    print(f"{'kernel':66}" + "".join(f"{heading:>13}" for heading, _, _ in COLUMNS))
    for name, values in last.items():
        print(f"{name:66}" + "".join(f"{value:13.2f}" for value in values))


if __name__ == "__main__":
    run_main(main)
