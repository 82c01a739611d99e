"""Formulas as drawings in the page: no script, no fonts, nothing to load from elsewhere."""

from __future__ import annotations

import re
from html import escape

import ziamath
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.writers.html5 import HTML5Translator

_SIZE = 17.0  # of the letters [px]

ziamath.config.svg2 = False  # paths, not symbols with names that several drawings would share


def _drawn(latex: str, *, inline: bool) -> str:
    """SVG whose baseline is that of the text around it."""
    svg = ziamath.Latex(latex, size=_SIZE, inline=inline, color="currentColor").svg()
    size = re.search(r'viewBox="\S+ (\S+) \S+ (\S+)"', svg)
    assert size is not None, svg[:200]
    below = float(size[1]) + float(size[2])
    words = escape(" ".join(latex.split()), quote=True)
    head = f'<svg role="img" aria-label="{words}" style="vertical-align: {-below:.2f}px" '
    return svg.replace("<svg ", head, 1)


def _inline(self: HTML5Translator, node: nodes.math) -> None:
    self.body.append(f'<span class="math">{_drawn(node.astext(), inline=True)}</span>')
    raise nodes.SkipNode


def _displayed(self: HTML5Translator, node: nodes.math_block) -> None:
    self.body.append(f'<div class="math">{_drawn(node.astext(), inline=False)}</div>')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_html_math_renderer("drawn", (_inline, None), (_displayed, None))
    return {"parallel_read_safe": True}
