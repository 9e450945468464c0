"""What ``help`` shows: signatures as they are written, and examples that run."""

import doctest
import inspect

import matplotlib.pyplot as plt
import pytest

import symhbm as sh

PLACES = [sh, sh.mistuning, sh.statistics, sh.plot]
PUBLIC = {
    f"{place.__name__}.{name}": getattr(place, name)
    for place in PLACES
    for name in place.__all__
    if callable(getattr(place, name))
}
WITHOUT_SIGNATURE = {"symhbm.ArchiveError", "symhbm.Status"}
WITH_EXAMPLES = [name for name, thing in PUBLIC.items() if ">>>" in (thing.__doc__ or "")]


@pytest.mark.parametrize("name", sorted(PUBLIC.keys() - WITHOUT_SIGNATURE))
def test_signatures_are_read_as_they_are_written(name):
    """Types of arrays are one word, not all that NumPy takes for one."""
    assert "_SupportsArray" not in str(inspect.signature(PUBLIC[name]))


@pytest.mark.parametrize("name", WITH_EXAMPLES)
def test_examples_run_by_themselves(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    plt.switch_backend("agg")
    (test,) = doctest.DocTestFinder(recurse=False).find(PUBLIC[name], name, globs={})
    lines: list[str] = []
    assert doctest.DocTestRunner().run(test, out=lines.append).failed == 0, "".join(lines)


def test_main_verbs_have_examples():
    verbs = {
        "frf",
        "follow",
        "solve",
        "periodic_motion",
        "verify",
        "minimise_peak",
        "peak_curve",
        "pareto_front",
    }
    verbs |= {"sensitivity", "condense", "Model", "single_blade", "bladed_disk", "HarmonicBalance"}
    assert {f"symhbm.{verb}" for verb in verbs} <= {*WITH_EXAMPLES}


def test_names_of_the_version_before_still_work():
    with pytest.warns(DeprecationWarning, match=r"symhbm.transient is now symhbm.periodic_motion"):
        assert sh.transient is sh.periodic_motion
    assert "transient" not in dir(sh)
