"""Measurements made of responses: what sensors on a problem would read, with noise or without."""

from typing import Any

import numpy as np

import symhbm as sh
from symhbm.continuation import solve_point
from symhbm.numerics import RADIANS


def complex_responses(
    problem: sh.HarmonicBalance, levels: Any, frequencies: Any, place: int = 0, harmonic: int = 1
) -> np.ndarray:
    """Complex amplitudes (n_levels, n_frequencies) [m], each solved for by itself."""
    basis, result = problem.basis, []
    for level in levels:
        at_level = problem.with_parameters(force_amplitude=level)
        for frequency in frequencies:
            found = solve_point(at_level, RADIANS * frequency)
            assert found.converged
            motion = at_level.layout.everywhere(found.unknowns)[place]
            cosine, sine = (motion[basis.component(harmonic, part)] for part in (False, True))
            result.append(cosine - 1j * sine)
    return np.reshape(result, (len(levels), len(frequencies)))


def measured_responses(
    problem: sh.HarmonicBalance,
    levels: Any,
    frequencies: Any,
    noise: float = 0.0,
    seed: int = 0,
    deviation: Any = 1e-6,
    **options: Any,
) -> Any:
    """A dataset of them; ``noise`` is relative to each response, real and imaginary part alike."""
    place, harmonic = options.get("place", 0), options.get("harmonic", 1)
    response = complex_responses(problem, levels, frequencies, place, harmonic)
    if noise:
        rng = np.random.default_rng(seed)
        deviation = noise * abs(response)
        parts = rng.standard_normal((2, *response.shape))
        response = response + deviation * (parts[0] + 1j * parts[1])
    return sh.datasets.measured(
        frequencies,
        response,
        units="m",
        deviation=deviation,
        force_amplitude=np.reshape(levels, (-1, 1)),
        **options,
    )
