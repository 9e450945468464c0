"""The table of synthesised responses in the guide is what its study computes."""

from pathlib import Path

import numpy as np
import pytest

from studies import synthesis_error as study
from tests.quick import quick_first

PAGE = Path(__file__).parent.parent.parent / "docs" / "guide" / "nonlinear-modes.md"
CASES = {case.name: case for case in study.cases()}


def told(name):
    """Cells of the lines of a structure in the guide."""
    lines = PAGE.read_text(encoding="utf-8").splitlines()
    assert study.HEADER in lines
    cells = [[cell.strip() for cell in line.strip("| ").split("|")] for line in lines]
    return [row for row in cells if row[0] == name]


@pytest.mark.parametrize("name", quick_first(CASES, 3))
def test_guide_has_the_figures_of_its_study(name):
    rows = list(study.compute(CASES[name]))
    expected, found = told(name), study.lines(rows)
    assert len(expected) == len(found) == 5
    for cells, line in zip(expected, found, strict=True):
        computed = [cell.strip() for cell in line.strip("| ").split("|")]
        assert cells[:3] == computed[:3]
        for told_there, computed_here in zip(cells[3:], computed[3:], strict=True):
            # Two digits are told, the last one may be round-off.
            if told_there.endswith("%"):
                value, other = (float(text.rstrip(" %")) for text in (told_there, computed_here))
                assert other == pytest.approx(value, rel=0.1)
            else:
                assert told_there == computed_here
    errors = np.array([row[4:] for row in rows])
    if "near" in name:
        # One mode does not stand for the response where another one is near.
        assert errors[:, 2].max() > 0.3
    elif name == "a stop, folds":
        # Before it touches the stop the blade is linear, and one mode exact.
        assert np.abs(errors[:2]).max() < 1e-8
    else:
        assert np.abs(errors[:, :2]).max() < 0.011
