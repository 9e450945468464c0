"""`view`: one page with the curves of an archive, their peaks, and what moves there."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import xarray as xr

from symhbm.model import Structure
from symhbm.numerics import check
from symhbm.plot.viewer.collected import Collected, together
from symhbm.plot.viewer.packing import plain
from symhbm.plot.viewer.page import plotting_library, structure_page
from symhbm.results import check_dataset
from symhbm.results.archive import draft_of

MOST_BYTES = 15_000_000
_SHARES = (1.0, 0.4, 0.1)
"""Shares of what a page usually holds, which are tried one after the other until it fits."""
_SUFFIXES = (".html", ".htm")


def view(
    result: xr.Dataset | Mapping[str, xr.Dataset] | Structure,
    path: str | os.PathLike[str],
    *,
    tuned: xr.Dataset | None = None,
    name: str | None = None,
) -> Path:
    """Write one page of HTML to look into a result with any browser, and return its path.

    The page needs no network, no server and nothing of symhbm, and has at most 15 MB. It shows the
    curves of each parameter set and each place, with what every point tells under the pointer;
    peaks and events with the hysteresis loops of their contacts and the shape of the motion; what
    contacts do along the curve; bands and largest responses of ensembles; frequency and damping of
    nonlinear modes, and limit cycles; tables of the peaks and of what failed; the parameters and
    where the result comes from. Numbers are those of the result to eight digits. Large results are
    thinned, and the page tells to what; peaks and events always stay. What a page cannot show of a
    result it says in words.

    Parameters
    ----------
    result
        A result of symhbm, or of `symhbm.load`, also a lazy one; or several by their names, whose
        curves are drawn over the same axes; or a structure with a mesh, of which the page shows
        the picture and the account of its import.
    path
        The file, with a name that ends in ``.html``. One that exists is replaced.
    tuned
        The response of the tuned structure, to show the amplification of an ensemble; see
        `symhbm.statistics.amplification`.
    name
        What the page calls the result, by default the name of its file.

    Raises
    ------
    ImportError
        Without plotly, which ``pip install 'symhbm[view]'`` installs.
    TypeError, ValueError
        For what is no dataset, another name of a file, and a result that does not fit.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    >>> response = sh.frf(problem, (10, 30), over={"normal_load": [1, 3]}, progress=False)
    >>> sh.view(response, "blade.html").name
    'blade.html'
    """
    if isinstance(result, Structure):
        target = _target(path)
        text = structure_page(result, plain(name or target.stem))
        with draft_of(target) as draft:
            draft.write_text(text, encoding="utf-8")
        return target
    several = isinstance(result, Mapping) and not isinstance(result, xr.Dataset)
    results: dict[str, Any] = dict(result) if several else {"": result}  # type: ignore[arg-type]
    if not results:
        raise ValueError("result: expected at least one")
    for one in results.values():
        check_dataset("result", one, unforced=True)
    if tuned is not None:
        check_dataset("tuned", tuned)
    target = _target(path)
    text = b""
    for share in _SHARES:
        pages = [
            Collected(one, tuned, plain(own or name or target.stem), share / len(results))
            for own, one in results.items()
        ]
        text = (together(pages) if len(pages) > 1 else pages[0].written()).encode("utf-8")
        if len(text) <= MOST_BYTES:
            break
    else:
        raise ValueError(
            f"result: a page of it would have {len(text) / 1e6:.3g} MB, expected at most "
            f"{MOST_BYTES / 1e6:g}; select fewer points, sets or contacts"
        )
    with draft_of(target) as draft:
        draft.write_bytes(text)
    return target


def _target(path: str | os.PathLike[str]) -> Path:
    """The file of a page; raises as `view`."""
    try:
        target = Path(path)
    except TypeError:
        raise TypeError(f"path={check.shown(path)}: expected text or a path") from None
    if target.suffix.lower() not in _SUFFIXES or not target.parent.is_dir():
        raise ValueError(
            f"path={str(target)!r}: expected a name ending in .html in an existing directory"
        )
    plotting_library()
    return target
