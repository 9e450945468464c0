"""Calls that are refused, as tables."""

from collections.abc import Callable, Iterable
from typing import Any

import pytest


def refused(rows: Iterable[tuple[Callable[[], Any], Any, str]]) -> Callable[..., None]:
    """A test that each call raises its error, whose one sentence has its words."""

    @pytest.mark.parametrize(("call", "error", "words"), [*rows])
    def test(call: Callable[[], Any], error: Any, words: str) -> None:
        with pytest.raises(error, match=words) as caught:
            call()
        assert "\n" not in str(caught.value)

    return test
