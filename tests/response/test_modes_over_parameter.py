"""Nonlinear modes of one amplitude over a parameter: closed forms, derivatives and datasets."""

from typing import Any

import numpy as np
import pytest
from closed_forms import OneBlade
from scipy.optimize import minimize_scalar
from sectors import random_disk, with_friction

import symhbm as sh
from symhbm.balance import unforced
from symhbm.continuation.unforced import ModeOverParameterProblem, NonlinearModeProblem
from tests.problems import BLADE

AMPLITUDE = 3e-4


def modes(problem, *given, **options):
    """Modes over the amplitude, or with a parameter given of one amplitude."""
    usual: dict[str, Any] = dict(amplitude=AMPLITUDE) if given else {}
    return sh.nonlinear_modes(problem, *given, **usual | dict(progress=False) | options)


def of_load(load, damping=0.5):
    """Angular frequency and damping ratio of the blade under a normal load, one harmonic."""
    return OneBlade(1, damping, 1e4, 1e4, slip_limit=0.5 * load).mode(AMPLITUDE)


@pytest.mark.parametrize("band", [(0.1, 10), (10, 0.1), (0, 10)])
def test_closed_form_over_the_normal_load(band):
    problem = sh.HarmonicBalance(sh.single_blade(**BLADE), harmonics=(1,))
    grid = np.linspace(min(band), 10, 23)
    found = modes(problem, "normal_load", band, at=grid)
    assert (found.n_solutions == 1).all()
    expected = np.array([of_load(load) for load in grid])
    np.testing.assert_allclose(2 * np.pi * found.frequency[:, 0], expected[:, 0], rtol=1e-12)
    np.testing.assert_allclose(found.damping_ratio[:, 0], expected[:, 1], rtol=1e-10)
    np.testing.assert_allclose(found.largest_displacement[:, 0, 0], AMPLITUDE, rtol=1e-12)
    path = modes(problem, "normal_load", band)
    kinds = path.event_kind.values.tolist()
    slip = "end of slip" if band[0] < band[1] else "onset of slip"
    assert sorted(kinds) == ["damping turns", slip]
    events = path.isel(event=kinds.index(slip))
    assert events.event_normal_load.item() == pytest.approx(2e4 * AMPLITUDE, rel=1e-12)
    turn = path.isel(event=kinds.index("damping turns"))
    best = minimize_scalar(lambda load: -of_load(load)[1], (1, 2.5, 5), tol=1e-14)
    assert turn.event_damping_ratio.item() == pytest.approx(-best.fun, rel=1e-13)
    assert turn.event_normal_load.item() == pytest.approx(best.x, rel=1e-6)
    assert path.residual_norm.max() < 1e-11


def test_derivatives_by_the_parameter():
    disk = with_friction(random_disk(5, cartesian=False))
    problem = unforced(sh.HarmonicBalance(disk, harmonics=(0, 1, 3)), 2)
    name = next(name for name in problem.parameters if name.endswith("normal_load"))
    curve = ModeOverParameterProblem(problem, 0, name, 1e-3)
    rng = np.random.default_rng(1)
    motion = 1e-3 * rng.normal(size=problem.n_unknowns)
    unknowns = np.concatenate([motion, [200.0, 0.02]])
    value = float(np.ravel(problem.parameters[name])[0])
    switches = curve.evaluate(unknowns, value).states.switches
    assert switches.any()

    def at(point, value):
        # The rows of the conditions have the unit of the balance, which moves as well.
        return curve.evaluate(point, value, switches).residual[: len(motion)]

    exact = curve.evaluate(unknowns, value, switches)
    step = 1e-6 * value
    slope = (at(unknowns, value + step) - at(unknowns, value - step)) / (2 * step)
    size = abs(slope).max()
    assert size > 0
    np.testing.assert_allclose(exact.by_parameter[: len(motion)], slope, atol=1e-7 * size)
    jacobian = exact.jacobian.toarray() if hasattr(exact.jacobian, "toarray") else exact.jacobian
    for k in range(len(unknowns)):
        step = 1e-6 * (abs(unknowns[k]) or 1.0)
        moved = np.zeros(len(unknowns))
        moved[k] = step
        slope = (at(unknowns + moved, value) - at(unknowns - moved, value)) / (2 * step)
        column = jacobian[: len(motion), k]
        np.testing.assert_allclose(column, slope, atol=2e-6 * abs(column).max())
    same = NonlinearModeProblem(problem, 0).evaluate(unknowns, -3.0, switches)
    np.testing.assert_allclose(same.residual[: len(motion)], exact.residual[: len(motion)])
