"""What differs between two results, in words."""

from collections.abc import Iterator

import xarray as xr

from symhbm.results.problem import NUMBERS
from symhbm.results.reading import largest
from symhbm.results.schema import check_dataset
from symhbm.results.telling.account import MARGIN, account, lines_of
from symhbm.results.telling.findings import ERRORS
from symhbm.results.telling.words import Rows

_ALIKE = "alike in problem and results, to six digits"


def compare(first: xr.Dataset, second: xr.Dataset) -> str:
    """What differs between two results: parameters, structure, versions, peaks.

    Parameters
    ----------
    first, second
        Results of this library.

    Returns
    -------
    Text to print, with a line for each of the two where they differ, and none where they do not.
    Errors such as residuals are left out.

    Raises
    ------
    TypeError
        For what is no dataset.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    >>> tight = sh.frf(problem.with_parameters(normal_load=6), (10, 30))
    >>> for line in sh.datasets.compare(sh.frf(problem, (10, 30)), tight).splitlines()[:2]:
    ...     print(line)
    normal_load             3 N
                        ->  6 N
    """
    lines = []
    for label, texts in _different(first, second):
        for head, text in zip((label, f"{'->':>{MARGIN - 2}}"), texts, strict=True):
            lines += lines_of(head, text, "none")
    tops = [_highest(one) for one in (first, second)]
    if all(tops) and tops[0] != tops[1]:
        change = 100 * (tops[1] / tops[0] - 1)
        lines.append(f"{'change of the peak':<{MARGIN - 1}} {change:+.3g} %")
    return "\n".join(lines) or _ALIKE


def differences(first: xr.Dataset, second: xr.Dataset) -> list[str]:
    """What differs between the problems of two results, few words for each."""
    found = _different(first, second, ("problem",))
    return [f"{label.replace('_', ' ')}: {one} or {other}" for label, (one, other) in found]


def _different(
    first: xr.Dataset,
    second: xr.Dataset,
    sections: tuple[str, ...] = ("problem", "origin", "results", "design", "others"),
) -> Iterator[tuple[str, tuple[str, str]]]:
    """Labels and both texts where they differ."""
    check_dataset("first", first, unforced=True)
    check_dataset("second", second, unforced=True)
    told = [{name: _joined(rows) for name, rows in account(of)} for of in (first, second)]
    for section in sections:
        one, other = (each.get(section, {}) for each in told)
        for label in dict.fromkeys([*one, *other]):
            texts = one.get(label, ""), other.get(label, "")
            if texts[0] != texts[1] and label.strip() not in ERRORS:
                yield label.strip(), texts
        if section == "problem" and not all(NUMBERS in of.variables for of in (first, second)):
            continue
        if section == "problem" and not first[NUMBERS].variable.equals(second[NUMBERS].variable):
            yield "matrices, forces", ("as they are", "others")


def _joined(rows: Rows) -> dict[str, str]:
    """Rows by their labels, with those that go on."""
    found: dict[str, str] = {}
    label = ""
    for name, text in rows:
        label = name or label
        found[label] = f"{found[label]}; {text}" if label in found else text
    return found


def _highest(dataset: xr.Dataset) -> float:
    """The highest peak, 0 where none is known."""
    found = largest(dataset, "peak_amplitude") if "peak_amplitude" in dataset.variables else None
    return 0.0 if found is None else found[0]
