"""Polynomials and laws of users: forces of random motions by sums over samples of the period."""

import numpy as np
import pytest

import symhbm as sh
from tests.problems import blade, problem

SAMPLES, OMEGA = 4096, 150.0


def coupled(values, u, v):
    return [values["hardening"] * (u**2 + v**2) * part for part in (u, v)]


def driven(values, u, v):
    """A slider marched over two periods."""
    load = values["normal_load"] + 0.1 * values["damper_mass"] * OMEGA**2
    limit, k = values["friction_coefficient"] * load, values["contact_stiffness"]
    place, force = 0.0, np.empty(len(u))
    for i in [*range(len(u))] * 2:
        place = min(max(place, u[i] - limit / k), u[i] + limit / k)
        force[i] = k * (u[i] - place)
    return [force, np.zeros(len(v))]


def own(values, u, v, rates):
    return [values["hardening"] * u**3 + values["loss"] * rates, np.zeros(len(v))]


@pytest.mark.parametrize(
    ("law", "error"), [("cubic", 1e-12), ("coupled", 1e-12), ("own", 1e-12), ("driven", 1e-5)]
)
@pytest.mark.parametrize("harmonics", ["1", "13", "0123"])
@pytest.mark.parametrize("size", [1e-4, 1e-3])
def test_forces_of_random_motions(law, error, harmonics, size):
    given = problem(f"{law} blade point {harmonics}")
    basis = given.basis
    motion = size * np.random.default_rng(5).normal(size=(3, basis.n_components))
    angle = 2 * np.pi * np.arange(SAMPLES) / SAMPLES
    shapes, rates = np.zeros((2, basis.n_components, SAMPLES))
    share = np.full(basis.n_components, 2 / SAMPLES)
    for n in basis.harmonics:
        shapes[basis.component(n)] = np.cos(n * angle)
        if n == 0:
            share[basis.component(n)] /= 2
            continue
        shapes[basis.component(n, sine=True)] = np.sin(n * angle)
        rates[basis.component(n)] = -n * OMEGA * np.sin(n * angle)
        rates[basis.component(n, sine=True)] = n * OMEGA * np.cos(n * angle)
    values = {name: np.ravel(value)[0] for name, value in given.parameters.items()}
    u, v = motion[:2] @ shapes
    if law == "own":
        forces = own(values, u, v, motion[0] @ rates)
    elif law == "cubic":
        forces = [values["cubic_stiffness"] * u**3, np.zeros(SAMPLES)]
    else:
        forces = {"coupled": coupled, "driven": driven}[law](values, u, v)
    expected = np.array(forces) @ shapes.T * share
    without = sh.HarmonicBalance(blade("none"), given.excitation, given.harmonics)
    with_law, alone = (p.evaluate(motion.ravel(), OMEGA).residual for p in (given, without))
    found = (with_law - alone).reshape(motion.shape)
    scale = np.abs(alone).max() + np.abs(expected).max()
    np.testing.assert_allclose(found[:2], expected, atol=error * scale)
    np.testing.assert_allclose(found[2], 0.0, atol=1e-12 * scale)
