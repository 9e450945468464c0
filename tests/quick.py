"""Cases of a test that all runs take, and others that run with the slow tests."""

from collections.abc import Iterable
from typing import Any

import pytest


def quick_first(cases: Iterable[Any], count: int) -> list[Any]:
    """Parameters of a test: the first ``count`` are quick, all others run with the slow tests."""
    return [
        pytest.param(
            *(case if isinstance(case, tuple) else (case,)),
            marks=() if i < count else pytest.mark.slow,
        )
        for i, case in enumerate(cases)
    ]
