"""Copies and sums of arrays (n,), as loops: numba compiles array expressions many times longer."""

from typing import Any

from symhbm.numerics.machine_code import Loop


@Loop
def copy(source: Any, target: Any) -> None:
    """Write an array into another one."""
    for i in range(len(source)):
        target[i] = source[i]


@Loop
def add(factor: float, source: Any, target: Any) -> None:
    """Add a multiple of an array to another one."""
    for i in range(len(source)):
        target[i] += factor * source[i]
