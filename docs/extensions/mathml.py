"""Formulas as MathML, which browsers typeset by themselves: no script, and no network.

Docutils turns LaTeX into MathML. A formula that it does not understand is a warning of the build.
"""

from xml.etree import ElementTree

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.writers.html5 import HTML5Translator

APPLY = "&ApplyFunction;"
"""An entity of HTML that XML does not know, after names of functions."""
NAMESPACE = "{http://www.w3.org/1998/Math/MathML}"

logger = logging.getLogger(__name__)


def mathml(formula: str, *, display: bool = False) -> str:
    r"""Return LaTeX as MathML; raise `MathError` where a command is not known.

    An accent stays on its letter where that has an index: docutils centres the ``j`` of
    ``\hat f_j`` below the letter.
    """
    written = tex2mathml(formula, as_block=display).replace(APPLY, "\u2061")
    tree = ElementTree.fromstring(written)
    for both in tree.iter(f"{NAMESPACE}munderover"):
        letter, index, accent = both
        if accent.tag == f"{NAMESPACE}mo" and accent.get("stretchy") == "false":
            over = ElementTree.Element(f"{NAMESPACE}mover", {"accent": "true"})
            over.extend([letter, accent])
            both.tag = f"{NAMESPACE}msub"
            both[:] = [over, index]
    for name in [*tree.iter(f"{NAMESPACE}mi"), *tree.iter(f"{NAMESPACE}mo")]:
        if len(name.text or "") > 1 and name.text.isalpha():
            # The names of functions, with the space that TeX has around them.
            name.tag = f"{NAMESPACE}mo"
            name.attrib |= {"lspace": "0.17em", "rspace": "0.17em"}
    ElementTree.register_namespace("", NAMESPACE.strip("{}"))
    return ElementTree.tostring(tree, encoding="unicode")


def visit_math(translator: HTML5Translator, node: nodes.math | nodes.math_block) -> None:
    """Write a formula in a line, or one on lines of its own."""
    display = isinstance(node, nodes.math_block)
    try:
        written = mathml(node.astext(), display=display)
    except MathError as error:
        logger.warning("formula %r: %s", node.astext(), error, location=node)
        written = translator.encode(node.astext())
    kind, tag = ("display", "div") if display else ("inline", "span")
    attributes = {"CLASS": f"math {kind}", "ids": []}
    translator.body.append(translator.starttag(node, tag, "", **attributes))
    translator.body.append(f"{written}</{tag}>")
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    """Add the renderer ``mathml``."""
    app.add_html_math_renderer("mathml", (visit_math, None), (visit_math, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
