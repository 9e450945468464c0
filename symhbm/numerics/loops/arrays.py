"""Copies and sums of arrays (n,), as loops: numba compiles array expressions many times longer."""

from symhbm.numerics.machine_code import Loop


@Loop
def copy(source, target) -> None:
    """Write an array into another one."""
    for i in range(len(source)):
        target[i] = source[i]


@Loop
def add(factor: float, source, target) -> None:
    """Add a multiple of an array to another one."""
    for i in range(len(source)):
        target[i] += factor * source[i]
