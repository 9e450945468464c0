"""What ``help`` shows: signatures as they are written, and examples that run."""

import doctest
import inspect
import re

import matplotlib.pyplot as plt
import pytest

import symhbm as sh
from symhbm.model import PARAMETERS
from symhbm.results import VARIABLES

PLACES = [sh, sh.laws, sh.forces, sh.datasets, sh.goals, sh.mistuning, sh.statistics, sh.plot]
PUBLIC = {
    f"{place.__name__}.{name}": getattr(place, name)
    for place in PLACES
    for name in place.__all__
    if callable(getattr(place, name))
}
ENTRY = re.compile(r"^(?P<names>\S[^\n]*)\n(?:[ ]+[^\n]*\n|\n)*", re.MULTILINE)
UNIT = re.compile(r"\[[^]]+\]|\bHz\b")
OF_ANOTHER = re.compile(r"\n +As (?:in|of) ")
NO_UNITS = "", "1", "as given", "variable_units"
PHYSICAL = {name for name, about in (VARIABLES | PARAMETERS).items() if about.units not in NO_UNITS}
PHYSICAL |= {"speed", "speeds", "coordinates", "gap", "area", "angle", "length"}
"""Variables, parameters and arguments that are nothing without a unit."""
WITHOUT_SIGNATURE = {"symhbm.response.datasets.ArchiveError", "symhbm.Run", "symhbm.Status"}
LONG = {"symhbm.maximise_flutter_limit", "symhbm.plot.flutter_limit"}
"""Examples that take seconds."""
WITH_EXAMPLES = [name for name, thing in PUBLIC.items() if ">>>" in (thing.__doc__ or "")]


@pytest.mark.parametrize("name", sorted(PUBLIC.keys() - WITHOUT_SIGNATURE))
def test_signatures_are_read_as_they_are_written(name):
    """Types of arrays are one word, not all that NumPy takes for one."""
    assert "_SupportsArray" not in str(inspect.signature(PUBLIC[name]))


@pytest.mark.parametrize(
    "name",
    [pytest.param(n, marks=[pytest.mark.slow] * (n in LONG)) for n in WITH_EXAMPLES],
)
def test_examples_run_by_themselves(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    plt.switch_backend("agg")
    (test,) = doctest.DocTestFinder(recurse=False).find(PUBLIC[name], name, globs={})
    lines: list[str] = []
    assert doctest.DocTestRunner().run(test, out=lines.append).failed == 0, "".join(lines)


def test_all_names_have_examples():
    assert sorted(PUBLIC.keys() - {*WITH_EXAMPLES}) == []


def section(name: str, title: str) -> str:
    """The text of a section of a docstring."""
    text = inspect.getdoc(PUBLIC[name]) or ""
    found = re.search(rf"^{title}\n-+\n(.*?)(?=^\w[\w ]*\n-+\n|\Z)", text, re.DOTALL | re.MULTILINE)
    return found[1] if found else ""


def test_physical_numbers_have_units():
    """Of parameters and attributes, and of the variables that are named where results are told."""
    silent = []
    for name in PUBLIC:
        for title in ("Parameters", "Attributes"):
            for entry in re.finditer(ENTRY, section(name, title)):
                told = {*entry["names"].partition(" : ")[0].split(", ")} & PHYSICAL
                known = UNIT.search(entry[0]) or OF_ANOTHER.search(entry[0])
                silent += [(name, one) for one in told if not known]
        results = section(name, "Returns")
        for one in {*re.findall(r"``(\w+)``", results)} & PHYSICAL:
            if not re.search(rf"``{one}``(?: \([^)]*\))?[^\[]{{0,90}}\[", results):
                silent.append((name, one))
    assert silent == []
