#!/usr/bin/env python3
"""Draws what `decant validate --report` found: a picture a case, simulated against reference, and a page
with the table. At several resolutions the finest is drawn in full, the coarser ones faint."""

import argparse
import base64
import html
from pathlib import Path

import h5py
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from one_line import run_main  # noqa: E402

COLORS = ["#4c78a8", "#e45756", "#54a24b", "#b279a2", "#f58518", "#72b7b2", "#9d755d"]
STYLE = """body{font:15px/1.5 system-ui,sans-serif;max-width:1080px;margin:2em auto;padding:0 1em;color:#222}
table{border-collapse:collapse;font-size:13px;margin:.6em 0}td,th{padding:.15em .7em;text-align:right;
border-bottom:1px solid #ddd}td:first-child,th:first-child{text-align:left}.pass{color:#1a7f37}
.fail{color:#cf222e;font-weight:bold}.reported{color:#777}img{max-width:100%}h2{margin-top:2em}"""


def text(values):
    return [v.decode() for v in values]


class Report:
    """One report, or several: of a case that several hold the last one counts."""

    def __init__(self, paths):
        self.runs, self.quantities, self.curves, self.orders = [], [], [], []
        for path in paths:
            self.add(path)

    def add(self, path):
        before = self.runs, self.quantities, self.curves, self.orders
        self.runs, self.quantities, self.curves, self.orders = [], [], [], []
        self.read(path)
        for row in self.quantities + self.curves:
            row["run"] += len(before[0])
        cases = {run["case"] for run in self.runs}
        self.runs = before[0] + self.runs
        self.orders = [o for o in before[3] if o["case"] not in cases] + self.orders

        def kept(rows):
            return [r for r in rows if self.runs[r["run"]]["case"] not in cases]

        self.quantities = kept(before[1]) + self.quantities
        self.curves = kept(before[2]) + self.curves
        for run in before[0]:
            run["replaced"] = run.get("replaced", False) or run["case"] in cases

    def read(self, path):
        with h5py.File(path) as file:
            if "decant_validation" not in file.attrs:
                raise SystemExit(f"{path}: not a report of decant validate")
            self.provenance = {k: v.decode() if isinstance(v, bytes) else v
                               for k, v in file["provenance"].attrs.items()}
            self.runs = self.rows(file["runs"])
            self.quantities = self.rows(file["quantities"])
            self.orders = self.rows(file["orders"])
            self.curves = [dict(curve.attrs, x=curve["x"][:], y=curve["y"][:],
                                x_label=self.label(curve["x"]), y_label=self.label(curve["y"]))
                           for _, curve in sorted(file["curves"].items())]
        for curve in self.curves:
            for key in ("panel", "name"):
                if isinstance(curve[key], bytes):
                    curve[key] = curve[key].decode()

    @staticmethod
    def rows(group):
        columns = {k: text(d[:]) if d.dtype.kind == "S" else d[:] for k, d in group.items()}
        return [dict(zip(columns, row)) for row in zip(*columns.values())]

    @staticmethod
    def label(dataset):
        attributes = {k: v.decode() if isinstance(v, bytes) else v
                      for k, v in dataset.attrs.items()}
        unit = attributes.get("unit", "1")
        return attributes["description"] + (f", {unit}" if unit not in ("", "1") else "")


def draw(report, runs, out):
    """All panels of one case; `runs` from coarse to fine."""
    finest = runs[-1]
    panels = list(dict.fromkeys(c["panel"] for c in report.curves if c["run"] == finest))
    if not panels:
        return False
    columns = min(len(panels), 2)
    lines = -(-len(panels) // columns)
    figure, axes = plt.subplots(lines, columns, figsize=(5.2 * columns, 3.7 * lines), squeeze=False,
                                constrained_layout=True)
    for spare in axes.flat[len(panels):]:
        spare.set_visible(False)
    for place, panel in zip(axes.flat, panels):
        colors, references = {}, 0
        for run in reversed(runs):
            for curve in report.curves:
                if curve["run"] != run or curve["panel"] != panel:
                    continue
                if curve["reference"]:
                    if run != finest:
                        continue
                    style = dict(color="#222", lw=1.2, ls=["-", "--", ":", "-."][references % 4])
                    if len(curve["x"]) > 5 and "measured" in curve["name"] or " 19" in curve["name"]:
                        style = dict(color="#222", ls="", marker="osv^"[references % 4], ms=3.5,
                                     mfc="none")
                    references += 1
                    place.plot(curve["x"], curve["y"], label=curve["name"], zorder=3, **style)
                    continue
                color = colors.setdefault(curve["name"], COLORS[len(colors) % len(COLORS)])
                resolution = report.runs[run]["resolution"]
                marks = {"marker": ".", "ls": ""} if len(curve["x"]) <= 41 else {"lw": 1.3}
                place.plot(curve["x"], curve["y"], color=color, zorder=2,
                           alpha=1 if run == finest else 0.3,
                           label=f"{curve['name']} (N = {resolution})" if run == finest else None,
                           **marks)
        first = next(c for c in report.curves if c["run"] == finest and c["panel"] == panel)
        place.set_xlabel(first["x_label"])
        place.set_ylabel(first["y_label"])
        place.set_title(panel, fontsize=10)
        place.legend(fontsize=7, framealpha=0.85)
        place.spines[["top", "right"]].set_visible(False)
    figure.savefig(out, dpi=80)
    plt.close(figure)
    return True


def figure_of(value, share=False):
    if np.isnan(value):
        return "–"
    if share:
        return f"{value:.1e}" if value < 1e-4 else f"{100 * value:.2f} %"
    return f"{value:.4g}"


def table(report, runs):
    cells = ["<tr><th>quantity<th>reference<th>result<th>error<th>allowed<th>verdict</tr>"]
    for run in runs:
        row = report.runs[run]
        cells.append(f"<tr><td colspan=6><b>N = {row['resolution']}</b>: {row['particles']} particles, "
                     f"dx = {row['particle_spacing']:.4g} m, {row['substeps']} substeps, "
                     f"{row['solver_seconds']:.1f} s</td></tr>")
        for q in report.quantities:
            if q["run"] != run:
                continue
            unit = f" [{q['unit']}]" if q["unit"] not in ("", "1") else ""
            cells.append(f"<tr><td>{html.escape(q['name'] + unit)}<td>{figure_of(q['reference'])}"
                         f"<td>{figure_of(q['result'])}<td>{figure_of(q['error'], True)}"
                         f"<td>{figure_of(q['allowance'], True)}"
                         f"<td class={q['verdict']}>{q['verdict']}</tr>")
    return "<table>" + "".join(cells) + "</table>"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("report", nargs="+",
                        help="HDF5 of decant validate; of a case in several, the last counts")
    parser.add_argument("--out", required=True, help="folder for pictures and index.html")
    arguments = parser.parse_args()
    report = Report(arguments.report)
    out = Path(arguments.out)
    out.mkdir(parents=True, exist_ok=True)
    gates = [q for q in report.quantities if q["verdict"] != "reported"]
    met = sum(q["verdict"] == "pass" for q in gates)
    page = [f"<!doctype html><meta charset=utf-8><title>Validation</title><style>{STYLE}</style>",
            f"<h1>Validation: {met} of {len(gates)} gates met</h1>"]
    runs = [r for r in report.runs if not r.get("replaced", False)]
    backends = dict.fromkeys((r["backend"], r["options"], r["executor"], r["device"]) for r in runs)
    page.append("<p>" + "; ".join(html.escape(" ".join(filter(None, b))) for b in backends)
                + f". Version {html.escape(str(report.provenance.get('git_revision', '')))}.</p>")
    for name in dict.fromkeys(r["case"] for r in runs):
        of_case = sorted((k for k, r in enumerate(report.runs)
                          if r["case"] == name and not r.get("replaced", False)),
                         key=lambda k: report.runs[k]["resolution"])
        page.append(f"<h2>{html.escape(name)}</h2>"
                    f"<p>{html.escape(report.runs[of_case[0]]['source'])}</p>")
        picture = out / f"{name}.png"
        if draw(report, of_case, picture):
            data = base64.b64encode(picture.read_bytes()).decode()
            page.append(f'<img alt="{html.escape(name)}" src="data:image/png;base64,{data}">')
        page.append(table(report, of_case))
        orders = [o for o in report.orders if o["case"] == name]
        if orders:
            page.append("<table><tr><th>observed order<th>from<th>to<th></tr>" + "".join(
                f"<tr><td>{html.escape(o['quantity'])}<td>{o['coarse']}<td>{o['fine']}"
                f"<td>{o['order']:.2f}</tr>" for o in orders) + "</table>")
    (out / "index.html").write_text("\n".join(page), encoding="utf-8")
    print(f"{met} of {len(gates)} gates met; wrote {out}/index.html")


if __name__ == "__main__":
    run_main(main)
