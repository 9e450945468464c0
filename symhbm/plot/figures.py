"""Figures in one style, which are saved alike: sharp, text as text, the same bytes each time."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal

import matplotlib as mpl
import matplotlib.pyplot as plt
from matplotlib.figure import Figure

from symhbm.numerics import check

STYLE: Any = {
    "figure.figsize": (6.4, 4.2),
    "figure.dpi": 110,
    "savefig.dpi": 200,
    "font.size": 10,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 10,
    "grid.color": "0.88",
    "grid.linewidth": 0.6,
    "legend.fontsize": 8.5,
    "legend.frameon": False,
    "lines.linewidth": 1.4,
    "mathtext.fontset": "dejavusans",
    # Text stays text, which can be searched, copied and edited.
    "svg.fonttype": "none",
    "pdf.fonttype": 42,
    # Names of parts come from the parts, so that the same picture is the same file.
    "svg.hashsalt": "symhbm",
}
FORMATS = ("png", "svg", "pdf")
"""Formats of pictures, by the endings of their names."""
_SAVING: Any = {name: STYLE[name] for name in ("savefig.dpi", "svg.fonttype", "svg.hashsalt")}
_SAVING |= {"pdf.fonttype": STYLE["pdf.fonttype"]}
"""What of the style Matplotlib asks for when a figure is saved."""
_NO_DATE: Any = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}


Size = Literal["column", "page"] | tuple[float, float]
"""Width and height of a figure [inch], or the width of a column or a page of a journal."""
_WIDTHS: dict[str, float] = {"column": 3.5, "page": 7.2}
_HEIGHTS = {"column": 1.25, "page": 1.0}
"""Heights over those in proportion: texts take more of a narrow figure."""
_STYLES: dict[str, Any] = {
    "column": {"font.size": 8, "axes.titlesize": 8, "legend.fontsize": 7, "lines.linewidth": 1.1}
}
"""What of the style is smaller."""


class SavedAlike(Figure):
    """A figure whose ``savefig`` keeps text as text and dates out of files, as `save` does."""

    def savefig(self, fname: Any, **options: Any) -> None:
        """Save the figure, by default with 200 dots per inch."""
        with mpl.rc_context(_SAVING):
            super().savefig(fname, **_without_date(fname, options))


def save(figure: Figure, path: str | os.PathLike[str], **options: Any) -> Path:
    """Save any figure of Matplotlib as PNG, SVG or PDF, by the ending of the name; its path.

    Text stays text, and the same picture is the same file each time. Figures of `symhbm.plot` have
    this from their own ``savefig``; here it is for a figure of yours with such axes in it.

    Parameters
    ----------
    figure
        Any figure.
    path
        A name that ends in ``.png``, ``.svg`` or ``.pdf``.
    options
        As of ``savefig`` of Matplotlib, for example ``dpi``, by default 200.

    Raises
    ------
    TypeError, ValueError
        For what is no figure, and for other endings.

    Examples
    --------
    >>> import matplotlib.pyplot as plt
    >>> import symhbm as sh
    >>> figure, ax = plt.subplots()
    >>> path = sh.plot.save(figure, "empty.svg")
    """
    check.instance("figure", figure, Figure, "a figure of Matplotlib")
    if not isinstance(path, (str, os.PathLike)):
        raise TypeError(f"path={check.shown(path)}: expected the name of a file")
    known = Path(path).suffix.removeprefix(".").lower() in FORMATS
    if not known or not Path(path).parent.is_dir():
        names = f"a name ending in .{', .'.join(FORMATS)} in an existing directory"
        raise ValueError(f"path={str(path)!r}: expected {names}")
    if figure.get_layout_engine() is None:
        options = {"bbox_inches": "tight"} | options  # labels and legends stay inside
    with mpl.rc_context(_SAVING):
        figure.savefig(path, **_without_date(path, options))
    return Path(path)


def _without_date(path: Any, options: dict[str, Any]) -> dict[str, Any]:
    """Options of ``savefig`` by which files of the formats with a date have none."""
    ending = Path(path).suffix if isinstance(path, (str, os.PathLike)) else ""
    kind = str(options.get("format") or ending.removeprefix(".")).lower()
    if kind not in _NO_DATE:
        return options
    return options | {"metadata": _NO_DATE[kind] | (options.get("metadata") or {})}


@contextmanager
def panels(
    rows: int = 1, columns: int = 1, *, size: Size | None = None, **options: Any
) -> Iterator[tuple[Figure, Any]]:
    """Open a figure of several axes in the style of the library, to draw into with ``ax=``.

    Gives the figure and its axes. Pyplot holds it, so that ``plt.show()`` opens its window; but in
    a notebook it is the value of its cell alone, and where an error ends the drawing it is closed.

    Parameters
    ----------
    rows, columns
        How many axes; with ``rows=0`` none, for a figure that you divide.
    size
        Width and height [inch], or ``"column"`` or ``"page"``, as wide as a column or a page of a
        journal.
    options
        As of ``plt.subplots``, for example ``sharex``.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    >>> with sh.plot.panels(1, 2, size=(9, 4)) as (figure, (left, right)):
    ...     drawn = sh.plot.model(problem, ax=left)
    ...     drawn = sh.plot.response(sh.frf(problem, (10, 30)), ax=right)
    >>> figure.savefig("both.svg")
    """
    with canvas(rows, columns, size, **options) as found:
        yield found


@contextmanager
def canvas(
    rows: int, columns: int, size: Size | None, own: Any = None, **options: Any
) -> Iterator[tuple[Figure, Any]]:
    """The same for a picture with a size of its ``own`` (2,) [inch]."""
    figsize, style = (own if size is None else size), {}
    if isinstance(size, str):
        width = _WIDTHS[check.one_of("size", size, _WIDTHS)]
        usual = own or STYLE["figure.figsize"]
        height = _HEIGHTS[size] * usual[1] * width / usual[0]
        figsize, style = (width, height), _STYLES.get(size, {})
    look: Any = dict(FigureClass=SavedAlike, layout="constrained", figsize=figsize)
    with plt.rc_context(STYLE | style):
        figure, axes = (
            plt.subplots(rows, columns, **look, **options) if rows else (plt.figure(**look), None)
        )
        interactive = mpl.is_interactive()
        try:
            yield figure, axes
        except BaseException:
            plt.close(figure)
            raise
        # At the end of a cell a notebook shows what pyplot holds, beside the value of the cell.
        if "inline" in mpl.get_backend().lower():
            plt.close(figure)
    # The backend of a notebook, loaded by the first figure, turns this on to show later ones.
    mpl.interactive(interactive)
