"""Maxima of condensed structures: their derivatives, curves and designs are those of the whole."""

import numpy as np
import pytest
import scipy.sparse as sp

import symhbm as sh
from symhbm.balance import SecondOrder

TIP = 23
BAND = (0.4, 2.6)


def chain(n=24):
    """Masses on springs, damped unevenly, that rub on the ground and on each other."""
    ones = np.ones(n)
    stiffness = 4e3 * sp.diags_array([-ones[1:], 2 * ones, -ones[1:]], offsets=[-1, 0, 1])
    stiffness = stiffness.tolil()
    stiffness[-1, -1] /= 2  # a free end, which moves most
    viscous = 0.1 * sp.eye_array(n) + sp.diags_array(np.where(np.arange(n) % 5, 0.0, 0.5))
    return sh.Model(
        sp.eye_array(n),
        viscous,
        stiffness,
        contacts=[(8,), (15, 18)],
        contact_stiffness=[2e3, 1e3],
        friction_coefficient=0.5,
        normal_load=[1.5, 1.0],
    )


def pair(harmonics=(1,), force=None):
    model, force = chain(), force or sh.forces.PointForce(TIP, amplitude=3.0)
    small = sh.condense(model, force, BAND, harmonics, places=[TIP], progress=False)
    return tuple(sh.HarmonicBalance(m, force, harmonics) for m in (model, small))


def inside():
    """A force inside of the structure, with a mean, of three harmonics."""
    shapes = np.random.default_rng(2).normal(size=(4, 24))
    return sh.forces.HarmonicForce({0: shapes[0], 1: shapes[1], 3: shapes[2]}, {1: shapes[3]})


@pytest.mark.parametrize(("harmonics", "force"), [((1,), None), ((0, 1, 2, 3), inside())])
def test_second_derivatives_are_exact(harmonics, force):
    problem = pair(harmonics, force)[1]
    second_order, rng = SecondOrder(problem, problem.differentiable), np.random.default_rng(0)
    unknowns, multipliers = rng.normal(size=(2, problem.n_unknowns))
    unknowns = 1e-2 * unknowns
    omega, amplitude, step = 2 * np.pi * 0.9, problem.excitation.amplitude, 1e-4
    place = second_order.places["force_amplitude"].start

    def at(omega, amplitude):
        changed = problem.with_parameters(force_amplitude=amplitude)
        return second_order(changed, unknowns, omega, multipliers)

    here = at(omega, amplitude)
    for column, change in ((problem.n_unknowns, (step, 0.0)), (place, (0.0, step))):
        ahead, behind = (
            at(omega + way * change[0], amplitude + way * change[1]) for way in (1, -1)
        )
        slope = (ahead.evaluation.residual - behind.evaluation.residual) / (2 * step)
        np.testing.assert_allclose(
            here.jacobian[:, column], slope, atol=1e-6 * np.abs(slope).max(), rtol=0
        )
        bend = (ahead.jacobian - behind.jacobian).T @ multipliers / (2 * step)
        np.testing.assert_allclose(
            here.hessian[:, column], bend, atol=1e-5 * np.abs(bend).max(), rtol=0
        )


def test_sensitivities_are_those_of_the_whole_structure():
    both = pair()
    dofs = both[1].model.dofs
    whole, small = (
        sh.datasets.sensitivity(sh.frf(problem, BAND, peaks="each", progress=False))
        for problem in both
    )
    kept = whole.isel(peak=np.isin(whole.peak_dof, dofs))
    assert dofs[small.peak_dof].tolist() == kept.peak_dof.values.tolist()
    assert small.sizes["peak"] > 6
    assert set(small.sensitivity_status.values) == {"exact"}
    for name in both[1].differentiable:
        for of in ("peak_amplitude", "peak_frequency"):
            expected = kept[f"{of}_by_{name}"].isel(peaking_dof=dofs).values
            size = np.nanmax(np.abs(expected))
            found = small[f"{of}_by_{name}"].values
            np.testing.assert_allclose(found / size, expected / size, atol=1e-8, rtol=0)


def test_the_band_of_the_condensation_is_the_default():
    curve = sh.peak_curve(pair()[1], "normal_load", (1.0, 1.2), progress=False)
    assert curve.status == sh.Status.REACHED_END
    assert np.all((BAND[0] <= curve.peak_frequency) & (curve.peak_frequency <= BAND[1]))
