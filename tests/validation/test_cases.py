"""Cases that other programs publish: each comparison of the report passes."""

import pytest

from tests.quick import quick_first
from tests.reference import CASES
from tests.validation.comparison import Verdict
from tests.validation.of_cases import WORDS

QUICK = ("tmdsimpy_duffing3_evaluation", "friction_beam_elastic")
"""Cases that take less than a second; the others run with the slow tests."""


@pytest.mark.parametrize("name", quick_first(sorted(WORDS, key=lambda one: one not in QUICK), 2))
def test_case(name):
    compare, _ = WORDS[name]
    failed = [row for row in compare(name, False) if row.verdict is not Verdict.PASSED]
    assert failed == []


def test_all_cases_are_compared():
    assert sorted(WORDS) == sorted(CASES)
