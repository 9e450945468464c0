"""Stability beside a stiff stop, against multipliers of motions that SciPy closes."""

import numpy as np
import pytest

import symhbm as sh
from tests.published_cases import TURN, problem
from tests.reference import CASES
from tests.time_domain.test_stability_changes import Motion, changes_of, state_of

NAME = "nlvib03_stop"
BAND = tuple(omega / TURN for omega in CASES[NAME]["sweep"])


def stop_in_time():
    """The two masses of the case, one against its stop."""
    model = CASES[NAME]["model"]
    damping, stiffness = np.array(model["C"]), np.array(model["K"])
    (stop,) = model["elements"]
    way, gap = np.array(stop["w"]), stop["gap"]

    def closed(x):
        return stop["stiffness"] * np.outer(way, way) * (way @ x > gap)

    return Motion(
        2,
        lambda x, v: stiffness @ x + damping @ v + closed(x) @ (x - gap * way),
        lambda x, v: (stiffness + closed(x), damping),
        np.array(model["force"]["1"]),
    )


def test_growth_is_that_of_the_exact_motion():
    """The stop closes for 4 % of the period, which few harmonics miss by a twentieth."""
    band = 0.6 / TURN, 0.65 / TURN  # where no other motion is
    found = sh.frf(problem(NAME, range(16)), band, at=[band[1]], progress=False)
    highest = found.isel(frequency=0, solution=0)
    values = stop_in_time().multipliers(0.65, state_of(highest))
    expected = np.log(np.abs(values).max()) * band[1]
    assert highest.growth_rate.item() == pytest.approx(expected, abs=5e-4)
    assert highest.stability.item() == 1


@pytest.mark.slow
@pytest.mark.parametrize(("highest", "near"), [(21, 5e-4), (41, 6e-5)])
def test_changes_are_those_of_the_exact_motions(highest, near):
    found = sh.frf(problem(NAME, range(highest + 1)), BAND, progress=False)
    motion, changes = stop_in_time(), changes_of(found)
    kinds = [kind for kind, _ in changes]
    assert kinds == ["period doubling"] * 2 + ["Neimark-Sacker"] * 2
    # At the last one the stop just touches, and motions at frequencies close by do not.
    for (kind, index), apart in zip(changes, (4e-5, near, near), strict=False):
        point = found.isel(point=index)
        omega, state = TURN * float(point.frequency), state_of(point)

        def unstable(shift, kind=kind, omega=omega, state=state):
            values = motion.multipliers(omega * (1 + shift), state)
            doubles = kind == "period doubling"
            return values.real.min() < -1 if doubles else np.abs(values).max() > 1

        assert unstable(-apart) != unstable(apart)
