#!/usr/bin/env python3
"""Writes a report of `decant conform --report` as one HTML page that needs nothing else.

    report_html.py build/reports/conformance.h5 -o report.html

Verdicts by backend and fixture, what failed and where, scores by check and backend with their
distribution, beside them what the oracle's own source scores in fp32, and where it all came from.
Needs numpy, h5py and matplotlib (build/venv has them). Exit status 2 where the file is no report.
"""
import argparse
import html
import os
import pathlib
import sys

import h5py

from report_plots import distribution_plot, slice_plot, three_way_plot

MOST_FAILING = 200  # rows told in full; the report has all

DISTRIBUTION_CAPTION = (
    "Score = |error| / tolerance of single values; up to 1 passes. Line: 1 to 99 % of the values, "
    "thick: the middle half, mark: median, tick: the worst. What scores less than 10⁻⁵, 0 as well, "
    "stands at the left edge, beyond 10³ at the right. Each on the fixture of its largest score.")
THREE_WAY_CAPTION = (
    "Backend (mark) beside the oracle's own source in sequential fp32 (ring), both against the "
    "oracle in double, whose tolerance is 1. A backend far to the right of its ring loses precision "
    "for a reason of its own. Each on the fixture of its largest ratio.")

MARK = {"pass": "✓", "fail": "✗", "not_run": "–"}
COLUMNS_SINCE_2 = {"value": "error", "float_score": "fp32_reference_score", "got": "actual"}
FIELDS_SINCE_2 = {"moved": "translated", "turned": "rotated"}

STYLE = """
:root { --ink: #26303a; --soft: #5b6670; --line: #d8dde2; --pass: #005a91; --fail: #b34700; }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 1rem; max-width: 66rem; color: var(--ink); background: #fff;
  font: 16px/1.45 system-ui, -apple-system, "Segoe UI", Roboto, "DejaVu Sans", sans-serif; }
h1 { font-size: 1.5rem; margin: .2rem 0; }
h2 { font-size: 1.2rem; margin: 2rem 0 .5rem; padding-top: 1rem;
  border-top: 1px solid var(--line); }
h3 { font-size: 1rem; margin: 1.2rem 0 .3rem; overflow-wrap: anywhere; }
p { margin: .4rem 0; max-width: 44rem; }
.soft, figcaption { color: var(--soft); font-size: .9rem; }
.wide { overflow-x: auto; margin-bottom: .8rem; }
table { border-collapse: collapse; font-size: .9rem; font-variant-numeric: tabular-nums; }
th, td { text-align: left; vertical-align: top; padding: .3rem .7rem .3rem 0;
  border-bottom: 1px solid var(--line); }
th { font-weight: 600; }
tbody th { font-weight: 400; }
.wide tbody th, .wide thead th:first-child { position: sticky; left: 0; background: #fff; }
small { color: var(--soft); font-size: .8rem; }
td { white-space: nowrap; }
tbody th { min-width: 8.5rem; max-width: 20rem; }
td.told { white-space: normal; }
td.any { white-space: normal; overflow-wrap: anywhere; }
.pass { color: var(--pass); }
.fail { color: var(--fail); font-weight: 700; }
.not_run { color: var(--soft); font-style: italic; }
.badge { display: inline-block; padding: 0 .6rem; border: 2px solid; border-radius: .4rem; }
figure { margin: .8rem 0; }
svg { display: block; width: 100%; height: auto; }
figure.plot { max-width: 38rem; }
.pair { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(20rem, 100%), 1fr));
  column-gap: 2rem; align-items: start; }
figure.scene { max-width: 30rem; }
svg text { font-family: system-ui, "DejaVu Sans", sans-serif !important; }
"""


def renamed(row):
    """A row of schema 2 with the names of schema 3."""
    row = {COLUMNS_SINCE_2.get(name, name): value for name, value in row.items()}
    first, space, rest = row["field"].partition(" ")
    if row["check"] == "invariance" and space:
        row["field"] = FIELDS_SINCE_2.get(first, first) + space + rest
    return row


def read(path):
    """Rows as dicts, provenance, and the surroundings' arrays and attributes, or None."""
    with h5py.File(path, "r") as file:
        if "decant_report" not in file.attrs:
            raise OSError("no report")
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
    for row in rows:
        options = f"({row['options']})" if row["options"] else ""
        row["label"] = f"{row['backend']}{options} {row['executor']}"
        row["name"] = row["check"] if row["check"] == row["field"] else \
            f"{row['check']} / {row['field']}"
    return rows, provenance, cloud, verdict


def ordered(values):
    """Each once, as they first occur."""
    return list(dict.fromkeys(values))


def text(value):
    return html.escape(str(value))


def number(value, digits=3):
    """NaN is nothing to show; thousands are read more easily than powers of ten."""
    if value != value:
        return "–"
    return f"{value:,.0f}" if 10**digits <= abs(value) < 1e6 else f"{value:.{digits}g}"


def combined(verdicts):
    return next(v for v in ("fail", "not_run", "pass") if v in verdicts)


def worst(rows):
    """A row that fails is worse than one that does not; then the score decides, NaN the largest."""
    return max(rows, key=lambda r: (r["verdict"] == "fail", r["score"] != r["score"], r["score"]))


def table(head, lines):
    """All cells are HTML; the first of each line is a heading."""
    out = "<div class=wide><table><thead><tr>" + "".join(f"<th>{c}</th>" for c in head)
    out += "</tr></thead><tbody>"
    for first, *rest in lines:
        out += f"<tr><th>{first}</th>" + "".join(c if c.startswith("<td") else f"<td>{c}</td>"
                                                 for c in rest) + "</tr>\n"
    return out + "</tbody></table></div>\n"


def verdict_cell(rows):
    if not rows:
        return "<td></td>"
    verdict = combined([r["verdict"] for r in rows])
    row = worst(rows)
    told = "not run" if verdict == "not_run" else number(row["score"])
    small = f"<br><small>{text(row['name'])}</small>" if verdict == "fail" else ""
    return f"<td class=told><span class={verdict}>{MARK[verdict]} {told}</span>{small}</td>"


def pass_table(rows, backends, fixtures):
    by_place = {}
    for row in rows:
        by_place.setdefault((row["label"], row["fixture"]), []).append(row)
    if len(backends) > max(6, len(fixtures)):
        return table(["backend", *map(text, fixtures)],
                     [[text(b), *(verdict_cell(by_place.get((b, f))) for f in fixtures)]
                      for b in backends])
    return table(["fixture", *map(text, backends)],
                 [[text(f), *(verdict_cell(by_place.get((b, f))) for b in backends)]
                  for f in fixtures])


def ratios(rows):
    """Score over that of sequential fp32, where both are."""
    return [r["score"] / r["fp32_reference_score"] for r in rows if r["fp32_reference_score"] > 0]


def score_cell(rows):
    if not rows:
        return "–"
    row = worst(rows)
    medians = [r["score_p50"] for r in rows if r["score_p50"] == r["score_p50"]]
    found = ratios(rows)
    small = []
    if medians and row["score"] != 0:
        small.append(f"median {number(max(medians), 2)}")
    if found and row["score"] != 0:
        small.append(f"{number(max(found), 2)} × fp32")
    verdict = combined([r["verdict"] for r in rows])
    mark = "" if verdict == "pass" else f" {MARK[verdict]}"
    return f"<span class={verdict}>{number(row['score'])}{mark}</span>" \
           f"<br><small>{' · '.join(small)}</small>"


def score_table(rows, backends):
    by_place = {}
    for row in rows:
        if row["check"] != "all":
            by_place.setdefault((row["name"], row["label"]), []).append(row)
    names = ordered(name for name, _ in by_place)
    return table(["check", *map(text, backends)],
                 [[text(n), *(score_cell(by_place.get((n, b))) for b in backends)] for n in names])


def particle_of(row):
    """The worst particle's id, if there is one, told from wall particles."""
    if row["worst_id"] < 0:
        return ""
    return f"{'wall ' if row['field'] == 'boundary_volume' else ''}{row['worst_id']}"


def failing_cells(row):
    component = "xyz"[row["worst_component"]] if 0 <= row["worst_component"] < 3 else ""
    first = f"{MARK[row['verdict']]} {text(row['name'])}"
    if row["reason"] != "beyond tolerance":
        first += f"<br><small>{text(row['reason'])}</small>"
    if row["n"] == 0:
        return [first, "", "", "", "", "", ""]
    unit = "" if row["unit"] in ("", "1") else text(row["unit"])
    got = number(row["actual"], 9) if row["expected"] == row["expected"] else ""
    return [first, f"<span class={row['verdict']}>{number(row['score'])}</span>",
            f"{particle_of(row)} {component}",
            *(f"{t} <small>{unit}</small>" if t else "" for t in (
                number(row["error"], 4), number(row["tolerance"], 4), got,
                got and number(row["expected"], 9)))]


def particles_table(rows):
    """Where the worst particles are and who is near, each once."""
    found = {}
    for row in rows:
        if row["worst_x"] == row["worst_x"]:
            found.setdefault(particle_of(row), row)
    if not found:
        return ""
    return table(["particle", "at, m", "fluid neighbors", "nearest", "wall neighbors"],
                 [[name, f"{r['worst_x']:.5f}, {r['worst_y']:.5f}, {r['worst_z']:.5f}",
                   str(r["fluid_neighbors"]), text(r["nearest"]), str(r["wall_neighbors"])]
                  for name, r in found.items()])


def failing_part(rows, cloud):
    """Every row that did not pass, by backend and fixture, and the picture where there is one."""
    bad = [r for r in rows if r["verdict"] != "pass"]
    if not bad:
        return ""
    out = "<h2>What did not pass</h2>\n"
    shown = bad[:MOST_FAILING]
    if len(bad) > len(shown):
        out += f"<p>The first {len(shown)} of {len(bad)} rows; the report has all.</p>\n"
    for place in ordered((r["label"], r["fixture"]) for r in shown):
        group = [r for r in shown if (r["label"], r["fixture"]) == place]
        out += f"<h3>{text(place[0])} on {text(place[1])}</h3>\n"
        out += table(["check", "score", "particle", "error", "tolerance", "actual", "expected"],
                     [failing_cells(r) for r in group])
        out += particles_table(group)
        if cloud and rows[cloud["row"]] in group:
            row = rows[cloud["row"]]
            out += f"<figure class=scene>{slice_plot(cloud, row)}<figcaption>Around particle " \
                   f"{particle_of(row)} ({text(row['name'])}): a slice 1.2 particle spacings " \
                   "thick, the circle its support radius. ParaView opens the report with all " \
                   "points around it.</figcaption></figure>\n"
    return out


def plot_section(title, drawn, caption):
    """`drawn`: the SVG, and what to say about its backends."""
    svg, note = drawn
    return f"<section><h2>{title}</h2>\n<figure class=plot>{svg}<figcaption>{caption} {note}" \
           "</figcaption></figure></section>\n"


def plots_part(rows, backends):
    judged = [r for r in rows if r["verdict"] != "not_run" and r["n"] > 0]
    exact = {r["name"] for r in judged} - {r["name"] for r in judged if r["score"] != 0}
    spread = [r for r in judged if r["score_p50"] == r["score_p50"] and r["name"] not in exact]
    three_ways = [r for r in judged if r["fp32_reference_score"] == r["fp32_reference_score"]]
    out = ""
    if spread:
        out += plot_section("Distribution of scores", distribution_plot(spread, backends),
                            DISTRIBUTION_CAPTION)
    if three_ways:
        out += plot_section("Three ways", three_way_plot(three_ways, backends), THREE_WAY_CAPTION)
    return f"<div class=pair>\n{out}</div>\n" if out else ""


def page(path, rows, provenance, cloud, verdict):
    backends, fixtures = ordered(r["label"] for r in rows), ordered(r["fixture"] for r in rows)
    failing = sum(r["verdict"] == "fail" for r in rows)
    missing = sum(r["verdict"] == "not_run" for r in rows)
    word = verdict.replace("_", " ")
    count = f"{len(fixtures)} fixture{'s' * (len(fixtures) != 1)} × {len(backends)} backend" \
            f"{'s' * (len(backends) != 1)}, {len(rows)} rows: {failing} fail, {missing} not run"
    out = "<!doctype html>\n<html lang=en><head><meta charset=utf-8>\n" \
          "<meta name=viewport content='width=device-width, initial-scale=1'>\n" \
          f"<title>{word}: {text(path.name)}</title><style>{STYLE}</style></head><body>\n"
    out += f"<h1>Conformance: <span class='badge {verdict}'>{MARK[verdict]} {word}</span></h1>\n"
    out += f"<p class=soft>{text(path.name)}: {count}</p>\n"
    if rows:
        out += "<h2>Backends and fixtures</h2>\n<p class=soft>The largest score, " \
               "|error| / tolerance; up to 1 passes (✓).</p>\n" + pass_table(rows, backends, fixtures)
        out += failing_part(rows, cloud)
        out += "<h2>Checks</h2>\n<p class=soft>Largest score over all fixtures; largest " \
               "median; largest ratio to what the oracle's source scores in sequential fp32.</p>\n"
        out += score_table(rows, backends)
        out += plots_part(rows, backends)
    out += "<h2>Provenance</h2>\n<div class=wide><table><tbody>"
    for key, value in sorted(provenance.items()):
        out += f"<tr><th>{text(key)}</th><td class=any>{text(value)}</td></tr>\n"
    return out + "</tbody></table></div>\n</body></html>\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("report", type=pathlib.Path, help="HDF5 of decant conform --report")
    parser.add_argument("-o", "--out", type=pathlib.Path, help="page to write; default: beside it")
    a = parser.parse_args()
    out = a.out or a.report.with_suffix(".html")
    try:
        made = page(a.report, *read(a.report))
    except (OSError, KeyError) as error:
        print(f"report_html: {a.report}: {error}", file=sys.stderr)
        return 2
    aside = out.with_name(out.name + ".partial")
    aside.write_text(made, encoding="utf-8")
    os.replace(aside, out)
    print(f"{out}: {len(made.encode()) // 1000} kB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
