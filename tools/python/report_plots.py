"""The plots of report_html.py, as SVG to stand in a page: no links, no fonts, nothing to load.

Colours are Okabe and Ito's, which the colour-blind tell apart; marks differ too. Ink and ground are the page's, by
name, so that a plot follows its colour scheme.
"""
import io
import re

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402

INK, SOFT, BAND, BEYOND = "#26303a", "#8a939b", "#f3f5f7", "#d55e00"
COLOURS = ("#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#000000")
MARKS = ("o", "s", "^", "D", "v", "P")
LEAST, MOST = 1e-5, 1e3  # scores drawn; what lies beyond stands at the edge
OF_THE_PAGE = {INK: "--ink", "#000000": "--ink", SOFT: "--soft", "#ffffff": "--paper", BAND: "--band"}
QUANTILES = (0, 1, 5, 25, 50, 75, 95, 99, 100)

plt.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "decant", "font.size": 8,
                     "axes.edgecolor": SOFT, "text.color": INK, "axes.labelcolor": INK,
                     "xtick.color": INK, "ytick.color": INK})


def literal(name):
    """A name is no formula, whatever it has of dollars."""
    return name.replace("$", r"\$")


def inline(figure, label, prefix):
    """The figure as an element of an HTML page. `prefix`: of its ids, which matplotlib gives to each figure anew."""
    out = io.StringIO()
    figure.savefig(out, format="svg", metadata={"Date": None})
    plt.close(figure)
    svg = out.getvalue()
    svg = svg[svg.index("<svg"):]
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    svg = re.sub(r'\s+xmlns(:\w+)?="[^"]*"', "", svg).replace("xlink:href", "href")
    svg = re.sub(r'(\bid="|href="#|url\(#)', rf"\g<1>{prefix}-", svg)
    svg = re.sub(r": (#[0-9a-f]{6})\b",
                 lambda m: f": var({OF_THE_PAGE[m[1]]})" if m[1] in OF_THE_PAGE else m[0], svg)
    return svg.replace("<svg", f'<svg role="img" aria-label="{label}"', 1)


def kept(score):
    """Within what is drawn; NaN reads as beyond."""
    return MOST if score != score else min(max(score, LEAST), MOST)


def groups(rows, backends, key):
    """Rows by name and series, of each the one with the largest key. More backends than colours are
    one series. Returns names, series, rows by (name, series), and what to say about it."""
    many = len(backends) > len(COLOURS)
    series = ["worst backend"] if many else list(backends)
    best = {}
    for row in rows:
        place = (row["name"], series[0] if many else row["label"])
        if place not in best or key(row) > key(best[place]):
            best[place] = row
    names = list(dict.fromkeys(row["name"] for row in rows))
    note = f"Of the {len(backends)} backends the one with the largest." if many else ""
    return names, series, best, note


def frame(names, series, label):
    """Axes with a line a name, log scores along them, the tolerance and a legend."""
    height = 0.085 + 0.105 * len(series)  # inches a name
    figure, axes = plt.subplots(figsize=(4.7, height * len(names) + 0.9), layout="constrained")
    axes.set_xscale("log")
    axes.axvline(1, color=BEYOND, lw=1, zorder=0)
    axes.set_yticks(range(len(names)), [literal(n) for n in names], fontsize=7)
    axes.set_ylim(len(names) - 0.4, -0.6)
    for k in range(1, len(names), 2):
        axes.axhspan(k - 0.5, k + 0.5, color=BAND, zorder=-1, lw=0)
    axes.tick_params(axis="y", length=0)
    axes.spines[["top", "right", "left"]].set_visible(False)
    axes.set_xlabel(label)
    return figure, axes


def offset(k, series):
    """Where the k-th of the series stands within its name's line."""
    return (k - (len(series) - 1) / 2) * 0.8 / max(len(series), 3)


def finish(figure, axes, least, most):
    axes.set_xlim(least / 1.6, most * 1.6)
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper left", ncols=2, frameon=False, fontsize=7.5,
                  handletextpad=0.3, columnspacing=1.2)


def distribution_plot(rows, backends):
    names, series, best, note = groups(rows, backends, lambda r: kept(r["score"]))
    figure, axes = frame(names, series, "score (1: the tolerance)")
    most, labelled = 1, set()
    for (name, backend), row in best.items():
        k = series.index(backend)
        q = {p: kept(row[f"score_p{p}"]) for p in QUANTILES}
        y, colour = names.index(name) + offset(k, series), COLOURS[k]
        most = max(most, q[100])
        axes.plot((q[1], q[99]), (y, y), color=colour, lw=0.9, solid_capstyle="butt")
        axes.plot((q[25], q[75]), (y, y), color=colour, lw=2.6, solid_capstyle="butt")
        axes.plot(q[50], y, MARKS[k], color="white", mec=colour, mew=0.9, ms=3.4,
                  label=None if backend in labelled else literal(backend))
        axes.plot(q[100], y, ">" if q[100] == MOST else "|", color=colour, ms=5, mew=1.1)
        labelled.add(backend)
    finish(figure, axes, LEAST, most)
    return inline(figure, "score distributions by check and backend", "distribution"), note


def three_way_plot(rows, backends):
    names, series, best, note = groups(
        rows, backends, lambda r: kept(r["score"]) / max(kept(r["fp32_reference_score"]), LEAST))
    figure, axes = frame(names, series, "score (1: the tolerance)")
    least, most, labelled = 1, 1, set()
    for (name, backend), row in best.items():
        k = series.index(backend)
        y, score, plain = names.index(name) + offset(k, series), kept(row["score"]), \
            kept(row["fp32_reference_score"])
        least, most = min(least, score, plain), max(most, score, plain)
        axes.plot((plain, score), (y, y), color=COLOURS[k], lw=0.9)
        axes.plot(plain, y, "o", color="white", mec=INK, mew=0.8, ms=4,
                  label=None if labelled else "sequential fp32")
        axes.plot(score, y, MARKS[k], color=COLOURS[k], ms=3.6,
                  label=None if backend in labelled else literal(backend))
        labelled.add(backend)
    finish(figure, axes, least, most)
    return inline(figure, "scores of backends beside sequential fp32", "three-ways"), note


def slice_plot(cloud, row):
    """The plane y = that of the worst particle: x to the right, z upward, cm."""
    center = np.array([row["worst_x"], row["worst_y"], row["worst_z"]])
    dx, reach = cloud["spacing"], cloud["support_radius"]
    shown = np.abs(cloud["position"][:, 1] - center[1]) <= 0.6 * dx
    x, z = (100 * (cloud["position"][shown][:, c] - center[c]) for c in (0, 2))
    wall, score = cloud["wall"][shown] == 1, cloud["score"][shown].astype(float)
    figure, axes = plt.subplots(figsize=(4.7, 4.5), layout="constrained")
    axes.set_aspect("equal")
    half = 100 * 6 * reach
    size = (0.8 * 100 * dx / (2 * half) * 3.6 * 72) ** 2  # a particle about as large as it is

    axes.scatter(x[wall], z[wall], s=0.5 * size, marker="s", color="#b9c0c6", linewidths=0,
                 label="wall", zorder=1)
    scored = ~wall & ~np.isnan(score)
    plain = ~wall & np.isnan(score)
    axes.scatter(x[plain], z[plain], s=size, color="#dfe3e8", linewidths=0, zorder=2, label="fluid")
    finite = score[scored & np.isfinite(score)]
    norm = matplotlib.colors.LogNorm(1e-2, max(10.0, float(finite.max(initial=0))), clip=True)
    order = np.argsort(score[scored], kind="stable")
    drawn = axes.scatter(x[scored][order], z[scored][order], s=size, cmap="Blues", norm=norm,
                         c=np.clip(score[scored][order], norm.vmin, norm.vmax), linewidths=0.4,
                         edgecolors=SOFT, zorder=3, rasterized=scored.sum() > 1500)
    beyond = scored & ~(score <= 1)
    axes.scatter(x[beyond], z[beyond], s=size, facecolors="none", edgecolors=BEYOND, linewidths=1.1,
                 zorder=4, label="beyond tolerance")
    axes.plot(0, 0, "+", color=BEYOND, ms=9, mew=1.6, zorder=6, label="the worst")
    axes.add_patch(plt.Circle((0, 0), 100 * reach, fill=False, color=INK, lw=1.2, zorder=5))
    axes.set_xlim(-half, half)
    axes.set_ylim(-half, half)
    axes.set_xlabel("x from the particle, cm")
    axes.set_ylabel("z from the particle, cm")
    axes.spines[["top", "right"]].set_visible(False)
    if scored.any():
        bar = figure.colorbar(drawn, ax=axes, shrink=0.75, pad=0.02)
        bar.set_label("score (1: the tolerance)")
        bar.outline.set_visible(False)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside upper left", ncols=4,
                  frameon=False, fontsize=7.5, handletextpad=0.3, columnspacing=1.0)
    return inline(figure, "slice of the scene around the worst particle", "slice")
