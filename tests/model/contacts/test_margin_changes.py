"""How far margins move with a motion: bounds that hold, and that tell something."""

import numpy as np
import pytest

from symhbm.model.contacts import Motions
from symhbm.numerics import FourierBasis
from tests.problems import LAWS, OWN_LAWS

DIRECTIONS = [(0,)], [(1,)], [(2,)]


@pytest.mark.parametrize("name", ["coulomb", "varying", "stop", "planar", "pressed"])
@pytest.mark.parametrize("harmonics", [(1, 3), (0, 1, 2, 3)])
def test_margins_stay_within_their_bounds(name, harmonics):
    """Of motions of all sizes, and of changes from round-off to the motion itself."""
    rng, basis, n = np.random.default_rng(0), FourierBasis(harmonics), 400
    group = LAWS[name](*DIRECTIONS)
    law, values = group.law, {key: np.full(n, value) for key, value in group.values.items()}
    size = len(law.directions) * basis.n_components
    motion = rng.normal(size=(n, size)) * 10.0 ** rng.uniform(-6, -2, size=(n, 1))
    change = np.abs(motion) * 10.0 ** rng.uniform(-6, 0, size=(n, 1))
    change[: n // 2, : size - basis.n_components] = 0.0  # along the last direction alone
    moved = motion + change * rng.choice([-1.0, 1.0], size=(n, size))
    none = np.zeros((n, len(law.switches)))
    at = Motions(basis, motion, np.full(n, 100.0), values)
    before = law.margins_within(at, none)
    after = law.margins_within(at._replace(motion=moved), none)
    bounds = law.margin_changes(at, change, before)
    known = np.isfinite(before) & np.isfinite(after)
    share = np.abs(after - before)[known] / (bounds[known] + 1e-12)
    assert share.max() <= 1
    assert share.max() > 0.2
    assert np.mean(np.isfinite(bounds[known])) > 0.5


def test_a_law_without_a_bound_says_so():
    law, basis = OWN_LAWS[0], FourierBasis((1,))
    at = Motions(basis, np.ones((2, 4)), 1.0, {"hardening": np.ones(2)})
    assert np.isinf(law.margin_changes(at, np.zeros((2, 4)), np.ones((2, 1)))).all()
