#!/usr/bin/env python3
"""Prints the summaries that `decant pour --json` leaves as a table, one line a pour.

A pour that ended early has no summary; its line says so."""

import argparse
import json
import pathlib

parser = argparse.ArgumentParser(description=__doc__,
                                 formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("summary", nargs="+", type=pathlib.Path, help="JSON of decant pour")
arguments = parser.parse_args()

places = ("receiver", "source", "in_flight", "spilled", "lost")
print(f"{'pour':<16}{'us/substep':>11}" + "".join(f"{p + ' %':>13}" for p in places) +
      f"{'through wall':>14}{'max density':>13}{'E end, mJ':>11}")
for path in arguments.summary:
    text = path.read_text(encoding="utf-8")
    if not text.strip():
        print(f"{path.stem:<16}no summary: it ended before its time")
        continue
    pour = json.loads(text)
    shares = "".join(f"{100 * pour['places'][p]['fraction']:13.3f}" for p in places)
    print(f"{path.stem:<16}{pour['substep_us']:11.1f}{shares}{pour['wall_crossings']:14d}"
          f"{pour['max_density_kg_m3']:13.1f}{1e3 * pour['kinetic_energy_end_J']:11.4f}")
