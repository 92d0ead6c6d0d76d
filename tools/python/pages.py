"""How pages are made: templates of the folder beside this file, which escape every value, and anchors."""

import os
import re
from pathlib import Path

import jinja2
from markupsafe import Markup, escape

TEMPLATES = Path(__file__).resolve().parent / "templates"


def number(value, digits=3):
    """NaN is nothing to show; thousands are read more easily than powers of ten."""
    if value != value:
        return "–"
    return f"{value:,.0f}" if 10**digits <= abs(value) < 1e6 else f"{value:.{digits}g}"


def share(value):
    """Of one, in percent where that can be read."""
    if value != value:
        return "–"
    return f"{value:.1e}" if value < 1e-4 else f"{100 * value:.2f} %"


def figure(value):
    return "–" if value != value else f"{value:.4g}"


def code(text):
    """What stands between backticks is code."""
    parts = text.split("`")
    return Markup().join(Markup("<code>{}</code>").format(p) if k % 2 else escape(p) for k, p in enumerate(parts))


def breakable(name):
    """A line may end after an underscore of it."""
    return Markup("_<wbr>").join(name.split("_"))


def anchors(prefix, texts):
    """An id for each text. It is made of the text, so that a link to it holds for the next report as well; those that
    would be the same are told apart by a number."""
    found = {}
    for text in texts:
        plain = f"{prefix}-{re.sub(r'[^0-9A-Za-z_.]+', '-', text).strip('-')}"
        anchor, k = plain, 2
        while anchor in found:
            anchor, k = f"{plain}-{k}", k + 1
        found[anchor] = True
    return list(found)


def render(template, **values):
    # A name that a template uses and nobody gives is an error, not an empty cell.
    environment = jinja2.Environment(loader=jinja2.FileSystemLoader(TEMPLATES), autoescape=True, trim_blocks=True,
                                     lstrip_blocks=True, undefined=jinja2.StrictUndefined)
    environment.filters.update(number=number, share=share, figure=figure, code=code, breakable=breakable)
    return environment.get_template(template).render(values)


def write_aside(path, text):
    """A page appears whole or not at all."""
    aside = path.with_name(path.name + ".partial")
    aside.write_text(text, encoding="utf-8")
    os.replace(aside, path)
