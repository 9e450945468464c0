"""Docstrings as pages: sections as they are written here, types by their short names.

Types stand in signatures alone, and what a function returns is told in sentences. So ``Returns``
is text, and ``Parameters``, ``Attributes``, ``Raises`` and ``Warns`` are lists without links. A
member of a class that a public base class has, too, is described with that.
"""

import inspect
import re
import sys
from importlib import import_module
from typing import Any

from docutils import nodes
from sphinx import addnodes
from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment
from sphinx.ext.napoleon import Config, NumpyDocstring
from sphinx.pycode import ModuleAnalyzer

import symhbm

LISTS = "Attributes", "Raises", "Warns"
CONFIG = Config(
    napoleon_attr_annotations=False,
    napoleon_use_param=False,
    napoleon_custom_sections=[("Returns", "notes"), *((name, "params_style") for name in LISTS)],
)
PATH = r"~?(?:\w+\.)*"
ARRAY = re.compile(
    rf"{PATH}ndarray\[{PATH}tuple\[{PATH}Any, \.\.\.\], "
    rf"{PATH}dtype\[({PATH}\w+)(?:\[[^]]*\])?\]\]"
)
"""What NumPy writes for ``NDArray[float64]``."""
ANY_ARRAY = re.compile(rf"~numpy\.typing\.NDArray\[{PATH}_ScalarT\]")
"""``NDArray`` alone."""
ARRAY_LIKE = re.compile(
    rf"{PATH}_Buffer \| {PATH}_SupportsArray\[.*?\]\] \| "
    rf"{PATH}_NestedSequence\[{PATH}_SupportsArray\[.*?\]\]\] \| "
    rf"(?:(?:bool|int|float|complex|str|bytes) \| )*{PATH}_NestedSequence\[[^]]*\]"
)
"""What NumPy writes for ``ArrayLike``."""

PUBLIC = {
    "ArrayLike": "numpy.typing.ArrayLike",
    "Executor": "concurrent.futures.Executor",
    "LinearConstraint": "scipy.optimize.LinearConstraint",
    "casadi.casadi.Function": "casadi.Function",
    "concurrent.futures._base.Executor": "concurrent.futures.Executor",
    "matplotlib.axes._axes.Axes": "matplotlib.axes.Axes",
    "scipy.sparse._csr.csr_array": "scipy.sparse.csr_array",
    "pandas.core.frame.DataFrame": "pandas.DataFrame",
    "xarray.core.dataarray.DataArray": "xarray.DataArray",
    "xarray.core.dataset.Dataset": "xarray.Dataset",
    "xr.Dataset": "xarray.Dataset",
}
"""Pages of other packages for names that signatures write otherwise."""


def sections(
    app: Sphinx, what: str, name: str, thing: object, options: object, lines: list[str]
) -> None:
    """Turn the sections of a docstring into fields.

    A property is read as a function is: else what stands before a colon is taken for its type.
    """
    if what == "data":
        lines[:] = below_assignment(thing)
    kind = "function" if what in ("property", "attribute", "data") else what
    lines[:] = NumpyDocstring(lines[:], CONFIG, app, kind, name, thing, options).lines()


def below_assignment(thing: object) -> list[str]:
    """Return the docstring of a constant: the string below it in the file it is from."""
    for name, module in sys.modules.copy().items():
        if name.startswith("symhbm."):
            for constant in [one for one, value in vars(module).items() if value is thing]:
                documented = ModuleAnalyzer.for_module(name).find_attr_docs()
                if ("", constant) in documented:
                    return documented["", constant]
    return []


def short(written: str) -> str:
    """Types of arrays by the names that NumPy's own pages have."""
    written = ARRAY_LIKE.sub("~numpy.typing.ArrayLike", written).replace("<factory>", "{}")
    written = ARRAY.sub(r"~numpy.typing.NDArray[\1]", written)
    return ANY_ARRAY.sub("~numpy.typing.NDArray", written)


def signature(
    app: Sphinx,
    what: str,
    name: str,
    thing: object,
    options: object,
    arguments: str | None,
    result: str | None,
) -> tuple[str | None, str | None]:
    """Return arguments and result with short types."""
    return arguments and short(arguments), result and short(result)


def shorten_properties(app: Sphinx, doctree: nodes.document) -> None:
    """Shorten the types of properties, which are no part of a signature."""
    for annotation in doctree.findall(addnodes.desc_annotation):
        written = annotation.astext()
        if (shorter := short(written).replace("~numpy.typing.", "")) != written:
            annotation.children = []
            annotation += nodes.Text(shorter)


def described_with_a_base(
    app: Sphinx, what: str, name: str, thing: Any, skip: bool, options: object
) -> bool | None:
    """Skip what a public base class has as well."""
    owner = named(getattr(thing, "__module__", None), getattr(thing, "__qualname__", ""), above=1)
    if isinstance(thing, property) and thing.fget:
        owner = named(thing.fget.__module__, thing.fget.__qualname__, above=1)
    if not isinstance(owner, type):
        return None
    names = {*symhbm.__all__, *symhbm.forces.__all__, *symhbm.laws.__all__, "Structure"}
    public = [base for base in owner.__mro__[1:] if base.__name__ in names]
    return True if any(hasattr(base, name) for base in public) else None


def named(module: str | None, path: str, above: int = 0) -> object:
    """Return what has this path in a module, or what it is in; None where there is no such."""
    try:
        thing: object = import_module(module) if module else None
        parts = path.split(".") if path else []
        for part in parts[: len(parts) - above]:
            thing = getattr(thing, part)
    except (ImportError, AttributeError):
        return None
    return thing


def found(path: str) -> object:
    """Return what has a dotted path, whichever part of it is a module; None where nothing has."""
    parts = path.split(".")
    for count in range(len(parts), 0, -1):
        if thing := named(".".join(parts[:count]), ".".join(parts[count:])):
            return thing
    return None


def public(
    app: Sphinx, env: BuildEnvironment, node: addnodes.pending_xref, text: nodes.Element
) -> None:
    """Let a reference to a name of another package lead to its page."""
    target = node["reftarget"]
    node["reftarget"] = PUBLIC.get(target, target)


def without_a_page(
    app: Sphinx, env: BuildEnvironment, node: addnodes.pending_xref, text: nodes.Element
) -> nodes.Element | None:
    """Show names without a link that are in the package and have no page; others are warned of."""
    target, source = node["reftarget"], node.source or ""
    # Tables hold first lines of docstrings, which are looked at where they stand whole.
    if node.get("refdomain") != "py" or source.endswith("<autosummary>"):
        return text if node.get("refdomain") == "py" else None
    place = source.partition("docstring of ")[2].rstrip(":")
    while place:
        if known_in(found(place), target):
            return text
        place = place.rpartition(".")[0]
    return text if target.startswith("symhbm.") and found(target) is not None else None


def known_in(scope: Any, target: str) -> bool:
    """Whether a module, a class, or a function with its arguments has a name."""
    first = target.partition(".")[0]
    if hasattr(scope, first):
        return True
    if inspect.isclass(scope) and f"self.{first}" in inspect.getsource(scope):
        return True
    return inspect.isfunction(scope) and first in inspect.signature(scope).parameters


def setup(app: Sphinx) -> dict[str, bool]:
    """Connect all of this."""
    app.connect("autodoc-process-docstring", sections)
    app.connect("autodoc-process-signature", signature)
    app.connect("autodoc-skip-member", described_with_a_base)
    app.connect("doctree-read", shorten_properties)
    app.connect("missing-reference", public, priority=100)
    app.connect("missing-reference", without_a_page, priority=900)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
