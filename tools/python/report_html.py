#!/usr/bin/env python3
"""Decides what the page of a report of `decant conform --report` shows; the page needs nothing else.

    report_html.py build/reports/conformance.h5 -o report.html

Verdicts by backend and fixture, what failed and where, scores by check and backend with their
distribution, beside them what the oracle's own source scores in fp32, what each check is, and where
it all came from. Layout and words are in templates/report.html.j2. Needs numpy, h5py, matplotlib and
Jinja2 (build/venv has them). Exit status 2 where the file is no report.
"""
import argparse
import pathlib
import sys

from markupsafe import Markup

from check_explanations import check_of, explanations
from one_line import open_hdf5, run_main
from pages import anchors, number, render, write_aside
from report_plots import QUANTILES, distribution_plot, slice_plot, three_way_plot

MOST_TOLD = 200  # failing rows told in full

MARK = {"pass": "✓", "fail": "✗", "not_run": "–"}
COLUMNS_SINCE_2 = {"value": "error", "float_score": "fp32_reference_score", "got": "actual"}
FIELDS_SINCE_2 = {"moved": "translated", "turned": "rotated"}
COLUMNS = {"backend", "options", "executor", "fixture", "check", "field", "unit", "verdict", "reason", "n", "error",
           "tolerance", "score", "fp32_reference_score", "worst_id", "worst_component", "actual", "expected",
           "worst_x", "worst_y", "worst_z", "fluid_neighbors", "wall_neighbors", "nearest",
           *(f"score_p{p}" for p in QUANTILES)}


def renamed(row):
    """A row of schema 2 with the names of schema 3."""
    row = {COLUMNS_SINCE_2.get(name, name): value for name, value in row.items()}
    first, space, rest = row["field"].partition(" ")
    if row["check"] == "invariance" and space:
        row["field"] = FIELDS_SINCE_2.get(first, first) + space + rest
    return row


def read(path):
    """Rows as dicts, provenance, and the neighborhood's arrays and attributes, or None."""
    with open_hdf5(path, ["decant_report"], "a report of decant conform") as file:
        schema = file.attrs["decant_report"]
        if schema not in (2, 3):
            raise OSError(f"schema {schema}, this script reads 2 and 3")
        columns = {name: data[:] for name, data in file["summary"].items()}
        rows = [{name: value.decode() if isinstance(value, bytes) else value.item()
                 for name, value in zip(columns, values)} for values in zip(*columns.values())]
        provenance = {k: v.decode() for k, v in file["provenance"].attrs.items()}
        cloud = None
        if "VTKHDF" in file:
            group = file["VTKHDF"]
            cloud = {name: data[:] for name, data in group["PointData"].items()}
            cloud["position"] = group["Points"][:]
            for name in ("row", "spacing", "support_radius"):
                cloud[name] = group.attrs[name].item()
        verdict = file.attrs["verdict"].decode()
    if schema == 2:
        rows = [renamed(row) for row in rows]
    if rows and (lacking := COLUMNS - rows[0].keys()):
        raise KeyError(f"no column {', '.join(sorted(lacking))} in /summary")
    return rows, provenance, cloud, verdict


def ordered(values):
    """Each once, as they first occur."""
    return list(dict.fromkeys(values))


def grouped(rows, key):
    found = {}
    for row in rows:
        found.setdefault(key(row), []).append(row)
    return found


def combined(verdicts):
    return next(v for v in ("fail", "not_run", "pass") if v in verdicts)


def worst(rows):
    """A row that fails is worse than one that does not; then the score decides, NaN the largest."""
    return max(rows, key=lambda r: (r["verdict"] == "fail", r["score"] != r["score"], r["score"]))


def particle_of(row):
    """The worst particle's id, if there is one, told from wall particles."""
    if row["worst_id"] < 0:
        return ""
    return f"{'wall ' if row['field'] == 'boundary_volume' else ''}{row['worst_id']}"


def score_of(row):
    """What a row has to show for its score: its reason where nothing was compared."""
    return number(row["score"]) if row["n"] > 0 else row["reason"] or "no values compared"


def complete(rows, explained):
    """Adds to each row what it is called and what of it is shown. Returns the anchor of each check."""
    for index, row in enumerate(rows):
        options = f"({row['options']})" if row["options"] else ""
        row["label"] = f"{row['backend']}{options} {row['executor']}"
        row["name"] = row["check"] if row["field"] in ("", row["check"]) else f"{row['check']} / {row['field']}"
        # The number that /checks/<row> has in the report.
        row["index"], row["anchor"] = index, f"row-{index:06}"
        row["particle"] = particle_of(row)
        row["component"] = "xyz"[row["worst_component"]] if 0 <= row["worst_component"] < 3 else ""
        row["why"] = "" if row["reason"] == "beyond tolerance" else row["reason"]
        row["shown_unit"] = "" if row["unit"] == "1" else row["unit"]
        single = row["expected"] == row["expected"]
        row["shown_actual"] = number(row["actual"], 9) if single else ""
        row["shown_expected"] = number(row["expected"], 9) if single else ""
        missing = row["verdict"] == "not_run"
        row["short"] = f"not run: {row['reason']}" if missing else f"score {number(row['score'])}" if row["n"] > 0 \
            else score_of(row)
    of_check = {name: check_of(name, explained) for name in ordered(r["check"] for r in rows)}
    checks = ordered([*explained, *of_check.values()])
    links = dict(zip(checks, anchors("check", checks)))
    for row in rows:
        row["part_of"] = of_check[row["check"]]
        row["check_anchor"] = links[row["part_of"]]
    return links


def particles(rows):
    """Rows that say where the worst particles are and who is near, of each particle one."""
    found = {}
    for row in rows:
        if row["worst_x"] == row["worst_x"]:
            found.setdefault(row["particle"], row)
    return list(found.values())


def place_of(rows, anchor):
    """What is said of one backend on one fixture."""
    verdict, ran = combined([r["verdict"] for r in rows]), [r for r in rows if r["verdict"] != "not_run"]
    place = {"label": rows[0]["label"], "fixture": rows[0]["fixture"], "anchor": anchor, "verdict": verdict,
             "rows": len(rows), "bad": [r for r in rows if r["verdict"] != "pass"], "name": "", "why": ""}
    if verdict == "not_run":
        place["told"] = "not run" if not ran else f"{len(place['bad'])} of {len(rows)} rows not run"
        place["why"] = "; ".join(ordered(r["reason"] for r in place["bad"]))
        return place
    row = worst(ran)
    place["told"] = number(row["score"])
    if verdict == "fail":
        place["name"] = row["name"]
        if row["n"] == 0:
            place["told"], place["why"] = "fail", row["reason"]
    else:
        nearest = sorted(rows, key=lambda r: -r["score"])[:3]
        place["nearest"] = nearest + [None] * (3 - len(nearest))
    return place


def matrix_of(places, backends, fixtures):
    """The longer of the two lists goes down the page."""
    if len(backends) > max(6, len(fixtures)):
        return {"head": ["backend", *fixtures],
                "lines": [{"name": b, "places": [places.get((b, f)) for f in fixtures]} for b in backends]}
    return {"head": ["fixture", *backends],
            "lines": [{"name": f, "places": [places.get((b, f)) for b in backends]} for f in fixtures]}


def add_details(places, bad, cloud):
    """What did not pass, row by row, and the picture where there is one."""
    told = {r["index"] for r in bad[:MOST_TOLD]}
    for place in places:
        place["full"] = [r for r in place["bad"] if r["index"] in told]
        place["short"] = [r for r in place["bad"] if r["index"] not in told]
        place["particles"] = particles(place["full"])
        row = next((r for r in place["bad"] if cloud and r["index"] == cloud["row"]), None)
        place["slice"] = row and {"svg": Markup(slice_plot(cloud, row)), "row": row}


def score_cell(rows):
    if not rows:
        return None
    verdict, ran = combined([r["verdict"] for r in rows]), [r for r in rows if r["verdict"] != "not_run"]
    reasons = ordered(r["reason"] for r in rows if r["verdict"] == "not_run" and r["reason"])
    if not ran:
        return {"verdict": verdict, "told": "– not run", "more": [], "reasons": reasons}
    row = worst(ran)
    more = []
    medians = [r["score_p50"] for r in ran if r["score_p50"] == r["score_p50"]]
    ratios = [r["score"] / r["fp32_reference_score"] for r in ran if r["fp32_reference_score"] > 0]
    if medians and row["score"] != 0:
        more.append(f"median {number(max(medians), 2)}")
    if ratios and row["score"] != 0:
        more.append(f"{number(max(ratios), 2)} × fp32")
    if len(ran) < len(rows):
        more.append(f"{len(rows) - len(ran)} of {len(rows)} not run")
    if row["verdict"] == "fail":
        told = f"{number(row['score'])} {MARK['fail']}" if row["n"] > 0 else f"{MARK['fail']} fail"
        reasons = ([row["reason"]] if row["n"] == 0 else []) + reasons
    else:
        told = number(row["score"])
    return {"verdict": "pass" if verdict == "not_run" else verdict, "told": told, "more": more, "reasons": reasons}


def scores_of(rows, backends):
    by_name = grouped((r for r in rows if r["check"] != "all"), lambda r: r["name"])
    lines = []
    for same in by_name.values():
        by_backend = grouped(same, lambda r: r["label"])
        lines.append({"row": same[0], "cells": [score_cell(by_backend.get(b)) for b in backends]})
    return lines


def checks_of(rows, explained, links):
    """Every check that is explained or has rows."""
    by_check = grouped(rows, lambda r: r["part_of"])
    return [{"name": name, "anchor": anchor, "text": explained.get(name), "rows": len(by_check.get(name, [])),
             "failing": sum(r["verdict"] == "fail" for r in by_check.get(name, [])),
             "missing": sum(r["verdict"] == "not_run" for r in by_check.get(name, []))}
            for name, anchor in links.items()]


def plots_of(rows, backends):
    """The SVG of each and what to say about its backends."""
    judged = [r for r in rows if r["verdict"] != "not_run" and r["n"] > 0]
    exact = {r["name"] for r in judged} - {r["name"] for r in judged if r["score"] != 0}
    spread = [r for r in judged if r["score_p50"] == r["score_p50"] and r["name"] not in exact]
    three_ways = [r for r in judged if r["fp32_reference_score"] == r["fp32_reference_score"]]
    plots = {"distribution": None, "three_ways": None}
    for name, draw, drawn in (("distribution", distribution_plot, spread), ("three_ways", three_way_plot, three_ways)):
        if drawn:
            svg, note = draw(drawn, backends)
            plots[name] = {"svg": Markup(svg), "note": note}
    return plots


def page(path, explained, rows, provenance, cloud, verdict):
    links = complete(rows, explained)
    backends, fixtures = ordered(r["label"] for r in rows), ordered(r["fixture"] for r in rows)
    by_place = grouped(rows, lambda r: (r["label"], r["fixture"]))
    places = {key: place_of(found, anchor) for (key, found), anchor
              in zip(by_place.items(), anchors("place", map(" on ".join, by_place)))}
    bad = [r for r in rows if r["verdict"] != "pass"]
    not_passed = [places[key] for key in ordered((r["label"], r["fixture"]) for r in bad)]
    add_details(not_passed, bad, cloud)
    return render(
        "report.html.j2", file=path.name, verdict=verdict, word=verdict.replace("_", " "), mark=MARK, rows=rows,
        backends=backends, fixtures=fixtures, failing=sum(r["verdict"] == "fail" for r in rows),
        missing=sum(r["verdict"] == "not_run" for r in rows), matrix=matrix_of(places, backends, fixtures),
        not_passed=not_passed, bad=len(bad), most_told=MOST_TOLD,
        passed=[p for p in places.values() if p["verdict"] == "pass"], scores=scores_of(rows, backends),
        checks=checks_of(rows, explained, links) if rows else [], provenance=provenance, **plots_of(rows, backends))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("report", type=pathlib.Path, help="HDF5 of decant conform --report")
    parser.add_argument("-o", "--out", type=pathlib.Path, help="page to write; default: beside it")
    parser.add_argument("--explain", type=pathlib.Path, metavar="FILE",
                        help="what decant conform --explain prints, of the version that made the report, one check "
                             "after the other; default: as in this checkout")
    a = parser.parse_args()
    out = a.out or a.report.with_suffix(".html")
    explained = explanations(a.explain)
    try:
        made = page(a.report, explained, *read(a.report))
    except (OSError, KeyError) as error:
        told = error.args[0] if isinstance(error, KeyError) else error
        print(f"report_html: {a.report}: {told}", file=sys.stderr)
        return 2
    write_aside(out, made)
    print(f"{out}: {len(made.encode()) // 1000} kB")
    return 0


if __name__ == "__main__":
    run_main(main)
