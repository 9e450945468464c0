"""How long the main steps take: ``python -m pytest tests/benchmarks --benchmark-only``."""

import numpy as np
import pytest

import symhbm as sh
from studies import fig03_single_blade as fig03
from symhbm.numerics.arrays import Factorisation
from tests.benchmarks.problems import ring


@pytest.mark.parametrize("harmonics", [(1,), (1, 3, 5)], ids=str)
def test_build(benchmark, harmonics):
    benchmark(ring, harmonics, 10)


@pytest.mark.parametrize("harmonics", [(1,), (1, 3, 5)], ids=str)
def test_residual_and_jacobian(benchmark, harmonics):
    problem = ring(harmonics, 10)
    unknowns = np.random.default_rng(0).normal(size=problem.n_unknowns) * 1e-5
    unknowns /= np.tile(problem.basis.order**3, 13)
    benchmark(problem.evaluate, unknowns, 1300.0)


@pytest.mark.parametrize("harmonics", [(1,), (1, 3, 5)], ids=str)
def test_factorisation(benchmark, harmonics):
    problem = ring(harmonics, 10)
    matrix = problem.evaluate(np.zeros(problem.n_unknowns), 1300.0).jacobian
    benchmark(Factorisation, matrix)


@pytest.mark.parametrize("load", [1, 3, 5, 18])
def test_curve_of_the_blade(benchmark, load):
    problem = fig03.problem().with_parameters(normal_load=load)
    result = benchmark(sh.frf, problem, (10, 30), progress=False)
    assert result.n_peaks == 1


@pytest.mark.parametrize("load", [10, 100])
@pytest.mark.parametrize("harmonics", [(1,), (1, 3, 5)], ids=str)
def test_curve_of_the_ring(benchmark, harmonics, load):
    problem = ring(harmonics, load)
    result = benchmark(sh.frf, problem, (150, 280), progress=False)
    assert result.n_peaks == 1
