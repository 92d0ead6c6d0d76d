#!/usr/bin/env python3
"""Prints the summaries that `decant pour --json` leaves as a table, one line a pour.

A pour that ended early has no summary; its line says so."""

import argparse
import pathlib

from one_line import need_file, read_json, run_main

PLACES = ("receiver", "source", "in_flight", "spilled", "lost")
WHAT = "JSON of decant pour"


def line(path):
    need_file(path, WHAT)
    if not path.read_bytes().strip():
        return f"{path.stem:<16}no summary: it ended before its time"
    pour = read_json(path, "places", dict, WHAT)
    shares = "".join(f"{100 * pour['places'][p]['fraction']:13.3f}" for p in PLACES)
    return (f"{path.stem:<16}{pour['substep_us']:11.1f}{shares}{pour['wall_crossings']:14d}"
            f"{pour['max_density_kg_m3']:13.1f}{1e3 * pour['kinetic_energy_end_J']:11.4f}")


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("summary", nargs="+", type=pathlib.Path, help=WHAT)
    arguments = parser.parse_args()
    lines = [line(path) for path in arguments.summary]
    print(f"{'pour':<16}{'us/substep':>11}" + "".join(f"{p + ' %':>13}" for p in PLACES) +
          f"{'through wall':>14}{'max density':>13}{'E end, mJ':>11}")
    print("\n".join(lines))


if __name__ == "__main__":
    run_main(main)
