#!/usr/bin/env python3
"""Decides what pictures and page show of a report of `decant validate --report`: a picture a case, simulated against
reference, and a page with the tables, which needs nothing else. At several resolutions the finest is drawn in full, the
coarser ones faint. Layout and words of the page are in templates/validation.html.j2."""

import argparse
import base64
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from one_line import open_hdf5, run_main  # noqa: E402
from pages import anchors, render, write_aside  # noqa: E402

COLORS = ["#4c78a8", "#e45756", "#54a24b", "#b279a2", "#f58518", "#72b7b2", "#9d755d"]


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
        with open_hdf5(path, ["decant_validation"], "a report of decant validate") as file:
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


def section(report, name, anchor, out):
    """What the page shows of one case; its picture is written as well."""
    indices = sorted((k for k, r in enumerate(report.runs) if r["case"] == name and not r.get("replaced", False)),
                     key=lambda k: report.runs[k]["resolution"])
    runs = [dict(report.runs[k], quantities=[q for q in report.quantities if q["run"] == k]) for k in indices]
    for run in runs:
        anchored = anchors(f"{anchor}-N{run['resolution']}", [q["name"] for q in run["quantities"]])
        for q, row_anchor in zip(run["quantities"], anchored):
            q["anchor"] = row_anchor
    picture = out / f"{name}.png"
    drawn = draw(report, indices, picture)
    return {"name": name, "anchor": anchor, "source": runs[0]["source"], "runs": runs,
            "picture": base64.b64encode(picture.read_bytes()).decode() if drawn else "",
            "orders": [o for o in report.orders if o["case"] == name]}


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
    runs = [r for r in report.runs if not r.get("replaced", False)]
    backends = dict.fromkeys((r["backend"], r["options"], r["executor"], r["device"]) for r in runs)
    names = list(dict.fromkeys(r["case"] for r in runs))
    cases = [section(report, name, anchor, out) for name, anchor in zip(names, anchors("case", names))]
    rows = [dict(q, case=case["name"], resolution=run["resolution"])
            for case in cases for run in case["runs"] for q in run["quantities"]]
    page = render("validation.html.j2", met=met, gates=len(gates), cases=cases,
                  backends=[" ".join(filter(None, b)) for b in backends],
                  version=report.provenance.get("git_revision", ""),
                  failing=[q for q in rows if q["verdict"] == "fail"])
    write_aside(out / "index.html", page)
    print(f"{met} of {len(gates)} gates met; wrote {out}/index.html")


if __name__ == "__main__":
    run_main(main)
