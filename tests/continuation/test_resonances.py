"""Resonances between points: counted at all of them, modes only where the numbers differ."""

import numpy as np
import pytest
from scipy.linalg import eigh

import symhbm as sh
from studies import fig03_single_blade as fig03
from symhbm.continuation.correctors.resonance_count import counted
from symhbm.continuation.events import modes
from symhbm.continuation.events import modes as resonances
from symhbm.continuation.following import follow_branch
from symhbm.continuation.problem import ContinuationProblem, FrequencyProblem, ParameterProblem
from symhbm.numerics.arrays import negative_eigenvalues
from symhbm.peaks.survey import sector_of
from tests.designs import ring
from tests.problems import rub

TURN = 2 * np.pi
SETS = [(1,), (0, 1), (1, 3), (2, 6), (0, 1, 2, 3), (1, 3, 5, 7, 9)]


@pytest.mark.parametrize("kind", [float, complex])
@pytest.mark.parametrize("size", [1, 2, 3, 7, 20, 60])
def test_negative_eigenvalues(size, kind):
    """Also with zeros on the diagonal, which need blocks of two rows, and of one sign."""
    rng = np.random.default_rng(size)
    for turn in range(30):
        vectors = np.linalg.qr(rng.normal(size=(size, size)).astype(kind))[0]
        if kind is complex:
            vectors = np.linalg.qr(vectors + 1j * rng.normal(size=(size, size)))[0]
        values = rng.choice([-1, 1], size) * 10.0 ** rng.uniform(-3, 3, size)
        if turn % 5 == 0:
            values = abs(values) * (-1) ** (turn % 2)
        matrix = (vectors * values) @ vectors.conj().T
        if turn % 3 == 0:
            np.fill_diagonal(matrix, 0.0)
            values = np.linalg.eigvalsh(matrix)
        assert negative_eigenvalues(matrix) == np.count_nonzero(values < 0)


def springs(problem, unknowns, friction):
    """Those of the contacts in each harmonic above 0, written once more."""
    basis, relative = problem.basis, problem.layout.relative(unknowns)
    law, (_, _, springs, limits) = friction.groups["friction"].details, problem.contacts.sliders()
    rows = []
    for n in problem.harmonics:
        if n == 0:
            continue
        row = []
        for j, y in enumerate(relative):
            stiffness, cubic = springs[j], problem.model.cubic_stiffness[j]
            both = np.flatnonzero(basis.order == n)
            force = stiffness * law.matrix[j] @ y
            force += limits[j] * law.vector[j]
            square, total = y[both] @ y[both], y @ y
            if square > total / 2:
                spring = force[both] @ y[both] / square
            else:
                spring = stiffness * np.trace(law.matrix[j][np.ix_(both, both)]) / 2
            rest = total - square
            row.append(np.clip(spring, 0, stiffness) + cubic * (0.75 * square + 1.5 * rest))
        rows.append(row)
    return rows


def structure(rng, size, massless=False):
    """Matrices of any pattern, full or not, and contacts between any of their motions."""
    factors = rng.normal(size=(3, size, size))
    mass, damping, stiffness = (factor @ factor.T + 0.1 * np.eye(size) for factor in factors)
    if rng.random() < 0.5:
        mass = np.diag(np.diag(mass))
    contacts = [tuple(rng.choice(size, rng.integers(1, min(size, 2) + 1), False)) for _ in range(3)]
    return sh.Model(
        mass,
        10.0 ** rng.uniform(-3, 1) * damping,
        10.0 ** rng.uniform(2, 4) * stiffness,
        contacts=contacts,
        **rub(10.0 ** rng.uniform(2, 5, 3), rng.uniform(0, 1, 3), rng.choice([0.0, 1.0, 30.0], 3)),
        cubic_stiffness=0.0 if rng.random() < 0.7 else 1e6,
    )


@pytest.mark.parametrize("harmonics", SETS)
@pytest.mark.parametrize("size", [1, 2, 6, 12])
def test_resonances_below_are_counted(size, harmonics):
    """Of structures, damping, motions and states of contacts that have nothing in common."""
    rng = np.random.default_rng([size, *harmonics])
    several = set()
    for _ in range(6):
        model = structure(rng, size)
        problem = sh.HarmonicBalance(
            model, sh.forces.PointForce(harmonic=max(harmonics)), harmonics
        )
        mass, stiffness = model.mass_matrix.toarray(), model.stiffness_matrix.toarray()
        directions = model.directions.toarray()
        curve = FrequencyProblem(problem)
        natural = np.sqrt(eigh(stiffness, mass, eigvals_only=True))
        for _ in range(6):
            unknowns = 10.0 ** rng.uniform(-5, 0) * rng.normal(size=problem.n_unknowns)
            omega = (
                rng.choice(natural) * rng.uniform(0.5, 2) / rng.choice([n for n in harmonics if n])
            )
            slip = rng.random(3) < 0.5 if rng.random() < 0.7 else None
            friction = problem.locate(unknowns, omega, slip)
            expected = []
            moving = [n for n in harmonics if n]
            for n, spring in zip(moving, springs(problem, unknowns, friction), strict=True):
                whole = stiffness + (directions.T * spring) @ directions
                squares = eigh(whole, mass, eigvals_only=True)
                expected.append(np.count_nonzero(squares < (n * omega) ** 2))
            assert counted(curve, np.append(unknowns, omega), friction)[0] == tuple(expected)
            several |= set(expected)
    assert len(several) > min(size, 4)


CURVES = {
    "blade": lambda: (FrequencyProblem(fig03.problem((1, 3, 5))), (10, 30)),
    "sector": lambda: (FrequencyProblem(sector_of(ring(harmonics=(1, 3)))), (150, 280)),
    "ring": lambda: (
        FrequencyProblem(ring(harmonics=(1, 3)).with_parameters(mass=MASSES)),
        (150, 220),
    ),
    "sampled": lambda: (
        FrequencyProblem(
            sh.HarmonicBalance(fig03.problem().model, sh.forces.PointForce(), (1, 3), 64)
        ),
        (10, 30),
    ),
    "load": lambda: (ParameterProblem(fig03.problem((1, 3)), "normal_load", 20 * TURN), (1, 9)),
    "stiffness": lambda: (
        ParameterProblem(fig03.problem((1, 3)), "stiffness", 20 * TURN),
        (6e3, 2e4),
    ),
    "one harmonic": lambda: (ParameterProblem(fig03.problem(), "mass", 20 * TURN), (0.5, 2)),
}
MASSES = 1 + 0.01 * np.random.default_rng(0).normal(size=13)


@pytest.mark.parametrize("name", CURVES)
def test_points_of_a_path_count_the_modes_they_have(name):
    curve, band = CURVES[name]()
    unit = TURN if isinstance(curve, FrequencyProblem) else 1.0
    branch = follow_branch(curve, (unit * band[0], unit * band[1]), 5000, False)
    assert len(branch.points) > 5
    for point in branch.points:
        problem, omega = curve.at(point.value)
        friction = problem.locate(point.unknowns, omega, point.switches)
        natural_modes = modes.modes(curve, point.unknowns, point.value, friction.switches)
        assert natural_modes is not None
        harmonics = [n for n in problem.harmonics if n > 0]
        below = natural_modes.exciting[natural_modes.detuning < 0]
        counted = tuple(np.count_nonzero(below == n * omega) for n in harmonics)
        assert point.resonances_below == counted


@pytest.mark.parametrize("name", CURVES)
def test_some_modes_are_those_of_all(name, monkeypatch):
    curve, band = CURVES[name]()
    unknowns, value = np.zeros(curve.problem.n_unknowns), band[0]
    unknowns[-1] = 1e-6
    value *= TURN if isinstance(curve, FrequencyProblem) else 1.0
    held = np.zeros(len(curve.evaluate(unknowns, value).states.switches), dtype=bool)
    harmonics = [n for n in curve.problem.harmonics if n > 0]
    every = modes.modes(curve, unknowns, value, held)
    last = curve.problem.n_dof
    for few in (modes._FEW, 0):
        monkeypatch.setattr(modes, "_FEW", few)
        for first in (0, last - 1):
            some = modes.modes(curve, unknowns, value, held, None, [(first, last)] * len(harmonics))
            assert every is not None
            assert some is not None
            number = np.tile(np.arange(last), len(harmonics))
            for one, other in zip(some, every, strict=True):
                expected = other[number >= first]
                np.testing.assert_allclose(one, expected, rtol=1e-9, atol=1e-9 * abs(value))


@pytest.mark.parametrize("name", CURVES)
def test_modes_are_computed_where_their_numbers_change(name, monkeypatch):
    computed_at, compute = [], resonances.modes

    def counted(curve: ContinuationProblem, unknowns, value, *given):
        computed_at.append(value)
        return compute(curve, unknowns, value, *given)

    monkeypatch.setattr(resonances, "modes", counted)
    curve, band = CURVES[name]()
    unit = TURN if isinstance(curve, FrequencyProblem) else 1.0
    branch = follow_branch(curve, (unit * band[0], unit * band[1]), 5000, False)
    below = [point.resonances_below for point in branch.points]
    changes = sum(after != before for after, before in zip(below[1:], below, strict=False))
    assert len(computed_at) <= 2 * (changes + branch.rejected)
    assert len(computed_at) < len(branch.points) / 4
