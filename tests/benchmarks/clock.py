"""CPU seconds of programs that take turns, so that noise hits all alike."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from symhbm.numerics import machine_code

# Loops are compiled at their second call, so that no program is timed while one of its loops waits.
machine_code._UNTIL_READ = machine_code._UNTIL_COMPILED = 0.0

ROUNDS = 5
SLOW = 1.0
"""CPU seconds of a call from which on one is enough."""

Prepared = Callable[[], Callable[[], Any]]
"""Prepares a program, which is not timed, and returns what is."""


@dataclass
class Timed:
    """CPU seconds of a call, and its result."""

    seconds: float
    result: Any


def cpu(function: Callable[[], Any]) -> Timed:
    """CPU seconds of one call."""
    start = time.process_time()
    result = function()
    return Timed(time.process_time() - start, result)


def take_turns(programs: dict[str, Prepared], rounds: int = ROUNDS) -> dict[str, Timed]:
    """Best of several calls of each program, after one in which it compiles what it compiles."""
    for prepare in programs.values():
        prepare()()
    best = {name: cpu(prepare()) for name, prepare in programs.items()}
    fast = [name for name, timed in best.items() if timed.seconds < SLOW]
    for _ in range(rounds - 1):
        for name in fast:
            again = cpu(programs[name]())
            if again.seconds < best[name].seconds:
                best[name] = again
    return best


def repeated(function: Callable[[], Any], calls: int = 200) -> float:
    """CPU seconds of one of many short calls, best of several rounds."""

    def many() -> None:
        for _ in range(calls):
            function()

    return min(cpu(many).seconds for _ in range(ROUNDS)) / calls
