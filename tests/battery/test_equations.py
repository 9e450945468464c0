"""What the project is: Eq. (9) is one CasADi function, which all that solves evaluates."""

import casadi as ca
import numpy as np
import pytest

from tests.problems import STRUCTURES, cases, cells, problem

OMEGA = 2 * np.pi * 24.0
QUICK = [
    "coulomb blade point 13", "varying rotor point 0123", "stop chain base 0123",
    "planar mistuned order 13", "pressed ring order 0123", "cubic reduced-ring order 13",
    "own chain point 1", "coupled mistuned order 13", "driven ring order 1", "none blade point 1",
    "coulomb sector static 0123", "pressed air order 0123", "cubic turning order 13",
    "planar reduced order 1", "own reduced-turning order 13",
]  # fmt: skip
WITH_MATRICES = [name for name in STRUCTURES if not name.startswith("condensed")]


@pytest.mark.parametrize("name", cases(QUICK, cells(structures=WITH_MATRICES)))
def test_equations_are_one_function_of_all_that_is_named(name):
    """Inputs are all parameters; what Newton evaluates is the function and its derivative."""
    given = problem(name)
    at = 3e-4 * np.random.default_rng(3).normal(size=given.n_unknowns)
    assert isinstance(given.residual, ca.Function)
    inputs = given.residual.name_in()
    integers = {name for name, value in given.parameters.items() if isinstance(value, int)}
    assert {*given.parameters} - integers <= {*inputs}
    values, evaluated = given.arguments(at, OMEGA), given.evaluate(at, OMEGA)
    residual = given.residual(**values)["residual"]
    np.testing.assert_array_equal(np.asarray(residual.full())[:, 0], evaluated.residual)
    exact = np.asarray(given.derivative("unknowns")(**values)["jacobian"].full())
    dense = evaluated.jacobian
    dense = dense.toarray() if hasattr(dense, "toarray") else dense
    np.testing.assert_array_equal(exact, dense)
