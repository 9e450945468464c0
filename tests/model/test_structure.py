"""A structure of a user's own, told by its dynamic stiffness alone, and models seen that way."""

import numpy as np
import pytest

import symhbm as sh
from symhbm.model import Structure
from tests.refusals import refused

DAMPER = dict(contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3.0)
SPEED, RIGIDITY, LENGTH = 100.0, 1e4, 1.0  # m/s, N, m


class Rod(Structure):
    """Longitudinal vibration of a clamped rod, felt at its free end: ``E A k cot(k L)``."""

    def __init__(self, loss=0.02, **contacts):
        super().__init__(1, [(0,)], **contacts)
        self.loss = loss

    def dynamic_stiffness(self, harmonic, frequency):
        modulus = 1 + 1j * self.loss
        speed = SPEED * np.sqrt(modulus)
        x = max(harmonic * frequency, 1e-6) * LENGTH / speed
        value = RIGIDITY * modulus / LENGTH * x / np.tan(x)
        slope = RIGIDITY * modulus / speed * (1 / np.tan(x) - x / np.sin(x) ** 2)
        return np.array([[value]]), np.array([[harmonic * slope]])

    def modes_below(self, harmonic, frequency, springs):
        """Modes below: those with the end held, and one more where the stiffness is negative."""
        s = harmonic * frequency
        x = s * LENGTH / SPEED
        stiffness = RIGIDITY / LENGTH * x / np.tan(x) + springs.sum()
        return int(x // np.pi) + int(stiffness < 0)


class ByHarmonics(Structure):
    """A model of which nothing but the dynamic stiffness is told."""

    def __init__(self, model):
        names = ("contact_stiffness", "friction_coefficient", "normal_load", "cubic_stiffness")
        values = {name: getattr(model, name) for name in names}
        super().__init__(model.n_dof, model.contacts, **values)
        self.model = model

    def dynamic_stiffness(self, harmonic, frequency):
        return self.model.dynamic_stiffness(harmonic, frequency)


def chain(**changes):
    values = DAMPER | {"contacts": [(0, 1), (2,)], "normal_load": [2.0, 3.0]} | changes
    matrix = 1e4 * (2 * np.eye(3) - np.eye(3, k=1) - np.eye(3, k=-1))
    return sh.Model(np.diag([1.0, 1.0, 2.0]), 5e-5 * matrix, matrix, **values)


class Blunt(Rod):
    """A rod that does not tell how many modes it has."""

    def modes_below(self, harmonic, frequency, springs):
        return None


def test_without_a_count_of_modes_paths_go_on():
    one, other = (
        sh.frf(sh.HarmonicBalance(kind(**DAMPER), sh.forces.PointForce()), (10, 40), progress=False)
        for kind in (Rod, Blunt)
    )
    np.testing.assert_allclose(one.peak_frequency, other.peak_frequency, rtol=1e-9)


OF_ROD = sh.HarmonicBalance(Rod(**DAMPER), sh.forces.PointForce())
test_what_needs_matrices_says_so = refused([
    *((call, (TypeError, ValueError), "matrices") for call in (
        lambda: sh.periodic_motion(OF_ROD, 20.0),
        lambda: sh.minimise_peak(OF_ROD, "normal_load", (1, 10), frequency_band=(10, 40)),
        lambda: sh.frf(OF_ROD, (10, 40), accuracy=1e-3),
        lambda: sh.frf(OF_ROD, (10, 40), stability=True),
        lambda: OF_ROD.residual,
        lambda: OF_ROD.model.mass_matrix,
    )),
    (lambda: OF_ROD.model.rotor, AttributeError, "no attribute 'rotor'"),
])  # fmt: skip


test_bad_structures_are_refused = refused([
    (lambda: Structure.__init__(object.__new__(Rod), 0), ValueError, "n_dof=0"),
    (lambda: Rod(normal_lod=3.0), KeyError, "normal_lod"),
    (lambda: Rod(contact_stiffness=1.0), ValueError, "friction_coefficient=None"),
    (lambda: Structure(1), TypeError, "abstract"),
])  # fmt: skip


class Changed(ByHarmonics):
    """A dynamic stiffness with a mistake."""

    def __init__(self, model, change):
        super().__init__(model)
        self.change = change

    def dynamic_stiffness(self, harmonic, frequency):
        return self.change(harmonic, *super().dynamic_stiffness(harmonic, frequency))


MISTAKES = {
    "sign": (lambda n, z, dz: (z, -dz), "expected its derivative"),
    "by its own frequency": (lambda n, z, dz: (z, dz / n if n else dz), "expected its derivative"),
    "factor": (lambda n, z, dz: (z, 1.01 * dz), "expected its derivative"),
    "none": (lambda n, z, dz: (z, 0 * dz), "expected its derivative"),
    "shape": (lambda n, z, dz: (z[:1, :1], dz[:1, :1]), "expected a value of shape"),
    "not a number": (lambda n, z, dz: (z * np.nan, dz), "expected a value of shape"),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_a_wrong_dynamic_stiffness_is_noticed(name):
    """A wrong derivative would leave the points right and move the peaks."""
    change, words = MISTAKES[name]
    force = sh.forces.HarmonicForce(cosine={1: [1, 0, 0]}, amplitude=1.0)
    problem = sh.HarmonicBalance(Changed(chain(), change), force, (1, 3))
    with pytest.raises(ValueError, match=words):
        sh.solve(problem, 11.5)
    with pytest.warns(RuntimeWarning, match=words):
        response = sh.frf(problem, (5, 40), progress=False)
    assert not response.converged.any()
