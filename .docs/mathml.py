"""Formulas as MathML, by docutils: browsers show it by themselves, so that the guide needs no network."""

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml


def formula(node, **how):
    """The MathML of a formula, its primes as primes; attributes stand in other quotes."""
    return tex2mathml(node.astext(), **how).replace("'", "′")


def inline(visitor, node):
    """A formula in a line."""
    visitor.body.append(formula(node))
    raise nodes.SkipNode


def block(visitor, node):
    """A formula of its own."""
    visitor.body.append(f'<div class="math">{formula(node, as_block=True)}</div>')
    raise nodes.SkipNode


def setup(app):
    """Offer it as `html_math_renderer`."""
    app.add_html_math_renderer("mathml", (inline, None), (block, None))
