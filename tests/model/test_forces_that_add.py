"""Sums of forces, static loads and what they do to responses."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

import symhbm as sh
from symhbm.balance import HarmonicBalance
from symhbm.model import force_coefficients
from symhbm.numerics.fourier import FourierBasis
from tests.refusals import refused

BASIS = FourierBasis((0, 1, 2, 3))
VALUES = dict(mass=1.0, stiffness=1e4, damping=0.5, contact_stiffness=5e3, friction_coefficient=0.5)
RING = sh.bladed_disk(6, **VALUES, normal_load=2.0)
WAVE = sh.forces.EngineOrder(2, 1.5)


def all_of(force, n_dof):
    return force_coefficients(force, n_dof, BASIS)


def test_a_sum_is_the_force_of_all_parts():
    """Against one pattern with every coefficient written out."""
    parts = (
        sh.forces.PointForce(place=1, amplitude=2.0, phase=0.4),
        sh.forces.PointForce(place=0, amplitude=-0.5, phase=-1.0, harmonic=3),
        sh.forces.EngineOrder(1, 0.25, harmonic=2),
        sh.forces.StaticLoad([4.0, 0.0, -1.0]),
        sh.forces.StaticLoad({2: 3.0}),
    )
    turn = 2 * np.pi * np.arange(3) / 3
    first, third = np.zeros((2, 2, 3))
    first[:, 1] = 2 * np.cos(0.4), -2 * np.sin(0.4)
    third[:, 0] = -0.5 * np.cos(1.0), -0.5 * np.sin(1.0)
    pattern = sh.forces.HarmonicForce(
        cosine={0: [4, 0, 2], 1: first[0], 2: 0.25 * np.cos(turn), 3: third[0]},
        sine={1: first[1], 2: 0.25 * np.sin(turn), 3: third[1]},
    )
    for order in (parts, parts[::-1]):
        found = order[0]
        for part in order[1:]:
            found = found + part
        assert len(found.parts) == 5
        np.testing.assert_allclose(all_of(found, 3), all_of(pattern, 3), rtol=0, atol=1e-15)
    np.testing.assert_array_equal(found.static(3), [4, 0, 2])


def test_one_oscillating_part_is_that_force_to_the_bit():
    force = WAVE + sh.forces.StaticLoad([0.0] * 6)
    np.testing.assert_array_equal(force.shape(6, BASIS), WAVE.shape(6, BASIS))
    assert force.amplitude == WAVE.amplitude
    assert force.parameters == WAVE.parameters


def test_force_amplitude_is_common_to_what_oscillates():
    one, other = sh.forces.PointForce(0, 2.0), sh.forces.PointForce(1, 0.3, harmonic=3)
    force = one + sh.forces.StaticLoad([7.0, 0.0]) + other
    assert force.parameters == {"force_amplitude": 2.0}
    larger = force.with_parameters(force_amplitude=5)
    np.testing.assert_allclose(larger.shape(2, BASIS), force.shape(2, BASIS))
    np.testing.assert_allclose(
        all_of(larger, 2),
        all_of(sh.forces.PointForce(0, 5.0) + sh.forces.PointForce(1, 0.75, harmonic=3), 2)
        + all_of(sh.forces.StaticLoad([7, 0]), 2),
    )
    # A sum of sums has the forces that its parts have.
    nested = larger + sh.forces.PointForce(1, 1.0)
    np.testing.assert_allclose(
        all_of(nested, 2), all_of(larger, 2) + all_of(sh.forces.PointForce(1, 1.0), 2)
    )
    off = force.with_parameters(force_amplitude=0)
    np.testing.assert_array_equal(all_of(off, 2)[:, 0], [7.0, 0.0])
    assert not all_of(off, 2)[:, 1:].any()
    again = off.with_parameters(force_amplitude=2.0)
    np.testing.assert_array_equal(all_of(again, 2), all_of(force, 2))


def test_parameters_that_one_part_has():
    force = WAVE + sh.forces.StaticLoad([3.0] * 6)
    other = force.with_parameters(engine_order=3, force_amplitude=2.0)
    assert other.parameters == {"force_amplitude": 2.0, "engine_order": 3}
    np.testing.assert_array_equal(
        all_of(other, 6), all_of(sh.forces.EngineOrder(3, 2.0) + sh.forces.StaticLoad([3.0] * 6), 6)
    )
    two = WAVE + sh.forces.EngineOrder(1, 0.1, harmonic=3)
    assert two.parameters == {"force_amplitude": 1.5}
    with pytest.raises(KeyError, match="'engine_order' is no parameter of this excitation"):
        two.with_parameters(engine_order=1)
    assert sh.forces.StaticLoad([1.0]).parameters == {}
    with pytest.raises(KeyError, match="'force_amplitude' is no parameter"):
        sh.forces.StaticLoad([1.0]).with_parameters(force_amplitude=1.0)


def test_the_mean_of_a_pattern_does_not_scale():
    force = sh.forces.HarmonicForce(cosine={0: [1.0, 2.0], 1: [1.0, 0.0]}, amplitude=10.0)
    by_number = sh.forces.HarmonicForce(cosine={0: {0: 1.0, 1: 2.0}, 1: {0: 1.0}}, amplitude=10.0)
    np.testing.assert_array_equal(by_number.static(2), force.static(2))
    for of_mean in (force, force.still):
        np.testing.assert_array_equal(of_mean.static(2), [10.0, 20.0])
    for amplitude in (0.0, 2.0):
        other = force.with_parameters(force_amplitude=amplitude)
        np.testing.assert_array_equal(other.static(2), [10.0, 20.0])
        np.testing.assert_array_equal(all_of(other, 2)[:, 1], [amplitude, 0.0])
    assert force == sh.forces.HarmonicForce(
        cosine={1: [1.0, 0.0]}, amplitude=10.0, mean=[10.0, 20.0]
    )


def test_representations_make_the_same_force():
    force = (WAVE + sh.forces.StaticLoad({0: 2.0, 3: -1.0})).with_parameters(force_amplitude=0.7)
    names = {kind.__name__: kind for kind in (sh.forces.EngineOrder, sh.forces.StaticLoad)}
    again = eval(repr(force), names)
    np.testing.assert_array_equal(all_of(again, 6), all_of(force, 6))
    assert "amplitude=0.7" in repr(force)


# Responses


def cubic(force, harmonics=(0, 1), stiffness=1e4, gamma=1e9):
    model = sh.Model([[1.0]], [[0.5]], [[stiffness]], contacts=[(0,)], cubic_stiffness=gamma)
    return sh.HarmonicBalance(model, force, harmonics)


def mean_of(load, vibration=0.0, stiffness=1e4, gamma=1e9):
    """Real root of k x + gamma (x^3 + 3/2 A^2 x) = F."""
    roots = np.roots([gamma, 0, stiffness + 1.5 * gamma * vibration**2, -load])
    return float(roots[np.abs(roots.imag) < 1e-9 * np.abs(roots).max()].real[0])


@pytest.mark.parametrize("load", [-2.0, 20.0, 3e3])
def test_a_cubic_spring_yields_to_a_static_load(load):
    """At rest k x + gamma x^3 = F; with one harmonic of amplitude A the spring feels 3/2 A^2 x."""
    alone = sh.solve(cubic(sh.forces.StaticLoad([load])), 9.0, throw=True)
    still = sh.forces.PointForce(amplitude=0.0) + sh.forces.StaticLoad([load])
    for point in (alone, sh.solve(cubic(still), 9.0, throw=True)):
        mean, vibration = point.coefficient.values[0]
        assert mean[0] == pytest.approx(mean_of(load), rel=1e-9)
        assert np.abs(vibration).max() < 1e-15 * abs(mean[0])
    moving = sh.forces.PointForce(amplitude=20.0) + sh.forces.StaticLoad([load])
    (mean, _), vibration = sh.solve(cubic(moving), 9.0, throw=True).coefficient.values[0]
    amplitude = np.hypot(*vibration)
    assert amplitude > 1e-5
    assert mean == pytest.approx(mean_of(load, amplitude), rel=1e-8)
    # The vibration: stiffness k + gamma (3 x^2 + 3/4 A^2).
    omega = 2 * np.pi * 9.0
    dynamic = 1e4 + 1e9 * (3 * mean**2 + 0.75 * amplitude**2) - omega**2 + 0.5j * omega
    assert amplitude == pytest.approx(20 / abs(dynamic), rel=1e-8)


# Archives, pictures, workers


def test_pictures_name_every_force():
    force = WAVE + sh.forces.StaticLoad({0: 20.0})
    figure = sh.plot.model(RING, force=force)
    text = figure.axes[0].get_xlabel().replace("\n", " ")
    assert "force of engine order 2 on 6 blades, $f_0$ = 1.5 N" in text
    assert "static load on 1 degree of freedom, up to 20 N" in text
    plt.close(figure)


# Wrong input


test_sums_with_something_else = refused(
    (add, TypeError, "expected an excitation to add")
    for other in (3, None, "force", sh.forces.StaticLoad, np.ones(6))
    for add in (lambda other=other: WAVE + other, lambda other=other: other + WAVE)
)


def fitted(force, harmonics):
    return HarmonicBalance(RING, force, harmonics)


test_bad_static_loads = refused([
    *((lambda values=values: sh.forces.StaticLoad(values), error, text) for values, error, text in (
        ({}, ValueError, "values={}: expected at least one"),
        ([], ValueError, r"values=\[\]: expected one value per degree"),
        ([[1.0]], ValueError, r"values=\[\[1.0\]\]: expected one value per degree"),
        ([np.nan], ValueError, r"values=\[nan\]"),
        ({0: np.inf}, ValueError, r"values\[0\]=inf"),
        ({0: [1.0, 2.0]}, ValueError, r"values\[0\]=\[1.0, 2.0\]: expected one number"),
        ({-1: 1.0}, ValueError, "degree of freedom of values=-1"),
        ({0.5: 1.0}, ValueError, "degree of freedom of values=0.5"),
        ({True: 1.0}, TypeError, "degree of freedom of values=True"),
        ([True], TypeError, r"values=\[True\]"),
        ("load", TypeError, "values='load'"),
        (None, TypeError, "values=None"),
    )),
    (lambda: fitted(sh.forces.StaticLoad([1.0] * 5), (0, 1)),
     ValueError, r"values: expected 6 values \(one per DOF\), got 5"),
    (lambda: fitted(WAVE + sh.forces.StaticLoad({6: 1.0}), (0, 1)),
     ValueError, "degree of freedom of values=6: .* from 0 to 5"),
    (lambda: fitted(WAVE + sh.forces.StaticLoad({0: 1.0}), (1, 3)),
     ValueError, r"harmonics=\(1, 3\): .* on harmonic 0"),
    (lambda: fitted(WAVE + sh.forces.EngineOrder(1, harmonic=2), (0, 1)),
     ValueError, r"harmonics=\(0, 1\): .* on harmonic 2"),
    (lambda: fitted(sh.forces.HarmonicForce(cosine={1: [1.0] * 6}, mean=[1.0]), (0, 1)),
     ValueError, "mean: expected 6 values"),
    (lambda: sh.forces.HarmonicForce(cosine={0: [1.0]}, mean=[1.0]),
     ValueError, r"mean=\[1.0\]: expected None beside cosine\[0\]"),
    (lambda: sh.forces.HarmonicForce(mean=[np.nan]), ValueError, "mean="),
    (lambda: sh.condense(
        sh.Model(np.eye(3), np.eye(3), 1e4 * np.eye(3), contacts=[(0,)], cubic_stiffness=1.0),
        sh.forces.StaticLoad([0, 1.0, 0]), (1, 5), places=[1],
    ), ValueError, "harmonic 0"),
])  # fmt: skip


def test_static_loads_choose_harmonics():
    assert HarmonicBalance(RING, WAVE).harmonics == (1,)
    assert HarmonicBalance(RING, WAVE + sh.forces.StaticLoad({0: 1.0})).harmonics == (0, 1)
