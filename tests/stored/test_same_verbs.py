"""Every verb finds what it found before, on structures of every class."""

from functools import cache

import numpy as np
import pytest

from tests.quick import quick_first
from tests.stored.verbs import CALLS, VERBS, found, read

NEAR = 1e-11
"""Largest difference of numbers, relative to the largest of their variable."""
SLOPES_NEAR = 1e-8
"""That of derivatives, residuals apart, which are round-off."""
ROUND_OFF = ("residual", "mismatch", "error", "multiplier", "drift")
"""Parts of names of variables that are round-off, or of which round-off decides digits."""


@cache
def before():
    return read(VERBS)


@pytest.mark.parametrize("name", quick_first(CALLS, 4))
def test_verbs_find_what_they_found(name):
    now, expected = found(name), before()[name]
    assert sorted(now) == sorted(expected)
    for key, values in expected.items():
        assert now[key].shape == values.shape, key
        if values.dtype.kind == "U":
            assert now[key].tolist() == values.tolist(), key
            continue
        if any(part in key for part in ROUND_OFF):
            continue
        near = SLOPES_NEAR if "derivative" in key or "slope" in key else NEAR
        scale = np.abs(values[np.isfinite(values)]).max(initial=0)
        np.testing.assert_allclose(now[key], values, rtol=near, atol=near * scale, err_msg=key)
