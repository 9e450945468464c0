"""Zeros between two values of opposite sign."""

import numpy as np
import pytest

from symhbm.numerics import bracketed_root


@pytest.mark.parametrize("start", [None, 0.05, 0.3, 0.6, 0.95])
@pytest.mark.parametrize(
    "slope",
    [
        lambda h: 0.3 - h,
        lambda h: np.cos(4 * h) - 0.5,
        lambda h: 1.0 if h < 0.6 else -2.0,  # a corner: no zero at all
        lambda h: np.sqrt(0.7 - h) if h < 0.7 else -h,
        lambda h: (h - 0.2) ** 2 * (0.5 - h) + 1e-3 * (0.5 - h),
        lambda h: 3e-7 - h,  # next to an end
        lambda h: 1 - 3e-7 - h,
    ],
)
def test_a_zero_between_values_of_opposite_sign(slope, start):
    share = bracketed_root(slope, start=start)
    aside = 1e-8
    assert slope(share - aside) > 0 > slope(share + aside)


@pytest.mark.parametrize("start", [None, 2e3])
def test_values_of_any_size(start):
    def falls(at):
        return 1.0 - (at / 1.5e3) ** 3

    assert bracketed_root(falls, 1e3, 3e3, start) == pytest.approx(1.5e3, rel=1e-13)


@pytest.mark.parametrize("start", [None, 0.9, 0.25])
def test_no_value_is_asked_for_twice(start):
    asked = []

    def rises(at):
        asked.append(at)
        return at**3 - 0.1

    found = bracketed_root(rises, start=start)
    assert found == pytest.approx(0.1 ** (1 / 3), abs=1e-11)
    assert len(asked) == len(set(asked)) < 16
    assert found in asked
