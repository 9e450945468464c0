"""Branches that cross a response, against equations written by hand and searches at random.

Two or three equal masses in a chain are driven so that the chain could move as symmetrically as it
is built. Motions that differ branch off where the equations of a small difference are singular.
"""

import warnings

import numpy as np
import pytest

import symhbm as sh
from symhbm.continuation import FrequencyProblem, follow_branch, other_branches
from tests.continuation.test_branch_points import (
    DAMPING,
    GAMMA,
    TURN,
    alike,
    all_solutions,
    pair,
    pitchforks,
)
from tests.problems import duffing
from tests.quick import quick_first


def followed(problem, band, **options):
    """A response over a band in rad/s, whatever its status tells."""
    with warnings.catch_warnings(action="ignore", category=RuntimeWarning):
        return sh.frf(problem, tuple(edge / TURN for edge in band), **options)


def points_of(branches, number):
    """Angular frequencies and complex motions ``x = Re(conj(c) exp(i w t))`` along a branch."""
    branch = branches.isel(branch=number, point=slice(int(branches.n_points[number])))
    coefficient = branch.coefficient.isel(harmonic=0).values
    return TURN * branch.frequency.values, coefficient[..., 0] + 1j * coefficient[..., 1]


@pytest.mark.slow
@pytest.mark.parametrize(("force", "coupling"), quick_first([(0.3, 0.1), (0.18, 0.02)], 1))
@pytest.mark.parametrize("band", quick_first([((0.5, 2.0),), ((2.0, 0.5),)], 1))
def test_branches_of_a_pair(force, coupling, band):
    exact = pitchforks(force, coupling)
    branches = sh.other_branches(followed(pair(force, coupling), band), throw=True)
    assert branches.branch_origin.values.tolist() == ["path", "branch point"]
    assert branches.branch_parent.values.tolist() == [-1, 0]
    for number in (0, 1):
        is_branch = branches.event_kind.values[number] == "branch point"
        at = TURN * branches.event_frequency.values[number][is_branch]
        np.testing.assert_allclose(np.unique(at.round(9)), exact, rtol=1e-9)
    # The branch goes from one pitchfork to the other and back, its masses exchanged.
    assert "closed" in branches.status.values[1]
    omega, motion = points_of(branches, 1)
    stiffness = np.array([[1 + coupling, -coupling], [-coupling, 1 + coupling]])
    forces = motion @ stiffness - (omega**2 + 1j * omega * DAMPING)[:, None] * motion
    forces += 0.75 * GAMMA * np.abs(motion) ** 2 * motion - force
    assert np.abs(forces).max() < 1e-11 * np.abs(motion).max()
    assert branches.residual_norm.max() < 1e-11
    apart = np.abs(motion[:, 0] - motion[:, 1])
    at_pitchfork = np.abs(omega[:, None] - exact).min(axis=1) < 1e-9
    assert apart[at_pitchfork].max() < 1e-6 < 1e-3 < apart[~at_pitchfork].min()


@pytest.mark.parametrize("omega", quick_first([1.3, 1.2, 1.4], 1))
def test_all_solutions_of_a_pair_are_on_its_branches(omega):
    """As many as random starts lead to, at one frequency."""
    path = follow_branch(FrequencyProblem(pair(0.3, 0.02)), (0.5, 2.0), 5000, False)
    found = [
        np.hypot(*state.state[:-1].reshape(2, 2).T)
        for branch in other_branches(path, (0.5, 2.0), 5000, 20)
        for state, _ in branch.branch.at(omega)
    ]
    everything = all_solutions(omega, 0.3, 0.02)
    assert len(found) == len(everything)
    distance = np.abs(np.array(found)[:, None] - everything).max(axis=2)
    assert distance.min(axis=0).max() < 1e-6
    assert distance.min(axis=1).max() < 1e-6


@pytest.mark.slow
def test_a_pair_of_branch_points_within_one_step():
    """The path alone passes over both; the search looks where derivatives are nearly singular."""
    response = followed(pair(0.6, 0.2), (0.5, 3.0))
    assert not (response.event_kind == "branch point").any()
    branches = sh.other_branches(response)
    is_branch = branches.event_kind.values[0] == "branch point"
    at = np.sort(TURN * branches.event_frequency.values[0][is_branch])
    np.testing.assert_allclose(at, pitchforks(0.6, 0.2), rtol=1e-9)
    assert branches.sizes["branch"] == 2


@pytest.mark.slow
def test_a_path_ends_where_more_than_two_branches_meet():
    """A ring of four has many branches, some of which end at double branch points."""
    coupling = 0.05
    turned = np.roll(np.eye(4), 1, axis=0)
    stiffness = (1 + 2 * coupling) * np.eye(4) - coupling * (turned + turned.T)
    model = sh.Model(
        np.eye(4),
        DAMPING * np.eye(4),
        stiffness,
        contacts=[(i,) for i in range(4)],
        cubic_stiffness=GAMMA,
    )
    problem = sh.HarmonicBalance(model, sh.forces.HarmonicForce(cosine={1: [0.3] * 4}))
    with pytest.warns(RuntimeWarning, match="curves are incomplete"):
        branches = sh.other_branches(followed(problem, (0.5, 2.0)), max_branches=14)
    assert branches.status.values[4] == sh.Status.SEVERAL_MEET
    assert branches.branch_parent.values[:5].tolist() == [-1, 0, 1, 1, 1]
    # The largest response of this one peaks where it begins and closes, and is level there.
    assert branches.status.values[13] != sh.Status.PEAK_NOT_LOCATED
    peaks = branches.isel(branch=13).peak_frequency.values
    begin = float(branches.branch_frequency[13])
    assert np.nanmax(np.abs(peaks - begin)) < 1e-12
    assert branches.residual_norm.max() < 1e-11
    for number in range(1, 14):
        omega, motion = points_of(branches, number)
        others, of_parent = points_of(branches, int(branches.branch_parent[number]))
        distance = np.abs(others - omega[0]) + np.abs(of_parent - motion[0]).max(axis=1)
        assert distance.min() < 1e-6


def closed_forms_at(omega, coupling):
    """Stiffenings and (force over amplitude) at which a pair gives way at one frequency.

    ``(stuck + 3 s)(stuck + s) + loss = 0`` for the stiffening ``s`` of differences.
    """
    stuck, loss = 1 + 2 * coupling - omega**2, (DAMPING * omega) ** 2
    springs = np.roots([3, 4 * stuck, stuck**2 + loss])
    return springs, np.sqrt((1 - omega**2 + springs) ** 2 + loss)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "band"), [("force_amplitude", (0.05, 1.0)), ("cubic_stiffness", (0.01, 1.0))]
)
def test_branch_points_over_a_parameter(name, band):
    """Values at which a pair gives way at one frequency have a closed form."""
    omega, coupling, force = 1.3, 0.02, 1.0 if name == "force_amplitude" else 0.3
    with pytest.warns(RuntimeWarning, match=r"symhbm\.other_branches"):
        response = sh.follow(pair(force, coupling), name, band, frequency=omega / TURN)
    springs, ratio = closed_forms_at(omega, coupling)
    exact = ratio * np.sqrt(springs / (0.75 * GAMMA))
    if name == "cubic_stiffness":
        exact = springs / (0.75 * (force / ratio) ** 2)
    found = response[f"event_{name}"].values[response.event_kind.values == "branch point"]
    np.testing.assert_allclose(np.sort(found), np.sort(exact), rtol=1e-10)
    branches = sh.other_branches(response)
    begin = branches[f"branch_{name}"].values[1:]
    assert np.abs(begin[:, None] - exact).min(axis=1).max() < 1e-9
    assert branches.residual_norm.max() < 1e-11
    assert branches.amplitude.isel(branch=1).diff("dof").max() > 0.1
    assert sh.verify(branches, exact="none", progress=False).residual_stored.max() < 1e-11


def test_other_solutions_at_an_end_of_the_band_are_followed():
    """A Duffing oscillator whose band ends between its folds: both parts are branches."""
    problem = duffing(damping=DAMPING, cubic=GAMMA)
    with pytest.warns(RuntimeWarning, match=r"symhbm\.other_branches"):
        response = sh.frf(problem, (0.5 / TURN, 1.2 / TURN))
    branches = sh.other_branches(response, throw=True)
    assert branches.branch_origin.values.tolist() == ["path", "other solution"]
    ends = [branches.isel(branch=i, point=int(n) - 1) for i, n in enumerate(branches.n_points)]
    ends.append(branches.isel(branch=1, point=0))
    found = np.sort([float(end.amplitude[0]) for end in ends])
    np.testing.assert_allclose(found, alike(1.2, 0.18), rtol=1e-9)


def test_the_number_of_branches_has_a_bound():
    response = followed(pair(0.3, 0.02), (0.5, 2.0))
    with pytest.warns(RuntimeWarning, match="other solutions branch off"):
        alone = sh.other_branches(response, max_branches=1)
    assert alone.sizes["branch"] == 1
    assert alone.status.item() == sh.Status.BRANCH_POINTS
    assert alone.attrs["searched"].endswith("the search ended at max_branches=1")


def test_branches_are_those_of_one_response():
    several = followed(pair(1.0, 0.02), (0.5, 0.6), over={"force_amplitude": [0.1, 0.2]})
    with pytest.raises(ValueError, match="got the dimension force_amplitude"):
        sh.other_branches(several)
    assert sh.other_branches(several.isel(force_amplitude=0)).sizes["branch"] == 1
    with pytest.raises(ValueError, match="max_branches"):
        sh.other_branches(several, max_branches=0)
