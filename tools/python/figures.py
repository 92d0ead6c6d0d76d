"""What the pictures have in common (a module; importing it chooses matplotlib's renderer for files)."""

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt


def save(figure, folder, name):
    for axes in figure.axes:
        axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(folder / f"{name}.png", dpi=90)
    plt.close(figure)
