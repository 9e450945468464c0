"""The picture of what to measure next: errors over what candidates differ by, the best filled."""

from typing import Any

import numpy as np
import pytest
import xarray as xr
from matplotlib.colors import same_color

import symhbm as sh


def ranked(**candidates: Any) -> xr.Dataset:
    """A ranking of three candidates, the best first."""
    table: dict[str, Any] = {
        f"candidate_{name}": ("candidate", of) for name, of in candidates.items()
    }
    table["expected_error"] = ("candidate", "unknown"), np.array([[0.1, 5], [0.2, 6], [0.3, 7]])
    table |= {"estimate": ("unknown", [-2.0, 100.0]), "standard_error": ("unknown", [1.0, 10.0])}
    return xr.Dataset(table, {"unknown": ["normal_load", "damping"]})


def test_errors_are_over_the_one_parameter_that_differs():
    dataset = ranked(force_amplitude=[2.0, 8.0, 1.0], engine_order=[3, 3, 3])
    [axes] = sh.plot.next_measurements(dataset).axes
    drawn: Any = axes.lines[:3]
    errors, best, known = drawn
    np.testing.assert_allclose(errors.get_xydata(), [[1, 0.15], [2, 0.05], [8, 0.1]])
    np.testing.assert_allclose(best.get_xydata(), [[2, 0.05]])
    np.testing.assert_allclose(known.get_xydata(), [[1, 0.5], [8, 0.5]])
    faces = [line.get_markerfacecolor() for line in (errors, best)]
    assert [same_color(face, "white") for face in faces] == [True, False]


def test_of_several_parameters_they_are_over_the_rank():
    dataset = ranked(force_amplitude=[2.0, 8.0, 1.0], engine_order=[3, 2, 1])
    [axes] = sh.plot.next_measurements(dataset).axes
    line: Any = axes.lines[0]
    np.testing.assert_allclose(line.get_xdata(), [1, 2, 3])
    assert axes.get_xlabel() == "rank"


def test_what_is_no_ranking_is_refused():
    with pytest.raises(TypeError, match="a result of next_measurements"):
        sh.plot.next_measurements(xr.Dataset({"estimate": 1.0}))
