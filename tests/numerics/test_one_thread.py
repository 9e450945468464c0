"""Linear algebra on one thread, and as many as before afterwards."""

from concurrent.futures import ThreadPoolExecutor
from threading import Barrier

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from symhbm.numerics import on_one_thread
from symhbm.numerics.threads import _State


def numbers():
    return {each["num_threads"] for each in threadpool_info() if each["user_api"] == "blas"}


@on_one_thread
def inside(barrier=None):
    if barrier is not None:
        barrier.wait()
    return numbers()


@on_one_thread
def failing():
    raise ValueError(str(numbers()))


def test_one_thread_inside_and_as_before_afterwards():
    with threadpool_limits(2, "blas"):
        before = numbers()
        assert before == {2}
        assert inside() == {1}
        with pytest.raises(ValueError, match=r"\{1\}"):
            failing()
        assert numbers() == before


def test_the_last_of_several_calls_at_once_restores():
    """Whichever began first."""
    with threadpool_limits(2, "blas"):
        for _ in range(3):
            barrier = Barrier(3)
            with ThreadPoolExecutor(3) as pool:
                [*pool.map(inside, [barrier] * 3)]
            assert numbers() == {2}
        assert inside() == {1}
    assert _State.calls == 0
