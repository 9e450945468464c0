"""Named groups of contacts and laws of a user's own: numbers, names and what is refused."""

import casadi as ca
import numpy as np
import pytest

import symhbm as sh
from tests.loops import loops_of
from tests.refusals import refused


class Quadratic(sh.laws.PolynomialLaw):
    """A force that pushes one way."""

    parameters = {"bend": sh.laws.Parameter("N m-2", "quadratic stiffness", bound="any")}  # noqa: RUF012
    degree, odd = 2, False

    def force_at(self, displacement, frequency, values):
        return values["bend"] * displacement**2


def law_of(name, power=3, **attributes):
    """A smooth law with one parameter of a name."""
    kind = type(
        "Law",
        (sh.laws.PolynomialLaw,),
        {
            "parameters": {name: sh.laws.Parameter("1", "some")},
            "degree": 3,
            "force_at": lambda self, y, frequency, values: values[name] * y**power,
            **attributes,
        },
    )
    return kind()


def one(law, harmonics=(1, 3), **values):
    group = sh.Contacts(law, [(0,)], **values)
    model = sh.Model([[1]], [[2]], [[1e4]], contacts={"group": group})
    return sh.HarmonicBalance(model, sh.forces.PointForce(amplitude=2.0), harmonics)


@pytest.mark.parametrize("harmonics", [(1,), (1, 3)])
def test_a_force_that_is_not_odd_needs_a_mean(harmonics):
    problem = one(Quadratic(), harmonics, bend=3e5)
    calls = (
        lambda: sh.solve(problem, 15),
        lambda: sh.frf(problem, (14, 15), progress=False),
        lambda: sh.frf(problem, (14, 15), accuracy=1e-3, progress=False),
        lambda: sh.follow(problem, "bend", (1e5, 3e5), frequency=15, progress=False),
    )
    for call in calls:
        with pytest.raises(ValueError, match=r"Quadratic\(\) is not odd; try harmonics=\(0, 1, 2"):
            call()


def made(law):
    return sh.Contacts(law, [(0,)], **dict.fromkeys(law.parameters, 1.0))


test_a_law_that_contradicts_itself_is_refused = refused([
    (lambda: made(law_of("some", 5)), ValueError, "degree=3 of Law.*no polynomial of this degree"),
    (lambda: made(law_of("some", 2)), ValueError, "odd=True of Law.*expected odd = False"),
    (lambda: made(law_of("some", degree=2.5)), ValueError, "degree of Law.*expected an integer"),
    (lambda: made(law_of("some", force_at=lambda self, y, f, v: ca.tanh(y / 1e-4))),
     ValueError, "no polynomial"),
    (lambda: made(law_of("some", force_at=lambda self, y, f, v: ca.fmax(y - 1e-3, 0))),
     ValueError, "no polynomial"),
    (lambda: made(law_of("two words")), ValueError, "'two words' is no name of a parameter"),
    (lambda: made(law_of("a.b")), ValueError, "'a.b' is no name of a parameter"),
])  # fmt: skip


TAKEN = "mass stiffness contacts groups n_dof records lumped force_amplitude engine_order"
test_names_of_structures_are_taken = refused(
    (lambda name=name: one(law_of(name), **{name: 1e6}),
     ValueError, f"parameter '{name}' needs a name of its own")
    for name in f"{TAKEN} unknowns frequency force_shape".split()
)  # fmt: skip


@pytest.mark.parametrize("name", ["amplitude", "dof", "residual_norm", "shroud_contact"])
def test_names_of_results_are_taken(name):
    problem = one(law_of(name), **{name: 1e6})
    for call in (lambda: sh.solve(problem, 15), lambda: sh.frf(problem, (14, 15), progress=False)):
        with pytest.raises(ValueError, match=f"parameter '{name}' of a contact law needs a name"):
            call()


def test_a_law_called_as_one_of_the_library_is_another_one():
    own = type(
        "Coulomb", (sh.laws.Coulomb,), {"slip_limit": lambda self, f, v: 2 * v["normal_load"]}
    )
    problem = one(own(), contact_stiffness=1e4, friction_coefficient=0.3, normal_load=2.0)
    assert type(sh.datasets.rebuild(sh.solve(problem, 15.0)).model.groups[0].law) is own


def test_loops_have_the_parameters_of_their_group():
    friction = {"contact_stiffness": 3e3, "friction_coefficient": 0.3}
    groups = {
        "spring": sh.Contacts(sh.laws.CubicSpring(), [(0,)], cubic_stiffness=1e4),
        "weak": sh.Contacts(sh.laws.Coulomb(), [(0,)], normal_load=2, **friction),
        "strong": sh.Contacts(sh.laws.Coulomb(), [(0, 1), (1,)], normal_load=[3, 4], **friction),
    }
    model = sh.Model(np.eye(2), 0.5 * np.eye(2), np.diag([1e4, 1.2e4]), contacts=groups)
    problem = sh.HarmonicBalance(model, sh.forces.PointForce(amplitude=3.0), (1, 3, 5))
    solved, exact = sh.solve(problem, 17.0), sh.periodic_motion(problem, 17.0)
    for dataset in (solved, exact):
        for contact, limit in {1: 0.6, 2: 0.9, 3: 1.2}.items():
            loop = loops_of(dataset, contact)[0][()]
            assert loop.limit == pytest.approx(limit)
            lost = float(dataset.dissipation[contact])
            assert loop.area == pytest.approx(lost, rel=1e-6, abs=1e-12)
        spring = loops_of(dataset, 0)[0][()]
        np.testing.assert_allclose(spring.force, 1e4 * spring.displacement**3, atol=1e-9)


def test_a_parameter_with_an_effect_of_its_own_raises_no_doubt(recwarn):
    """Without a normal load at rest, the load of rotation makes the friction."""

    class Pressed(sh.laws.Coulomb):
        parameters = sh.laws.Coulomb.parameters | {"damper_mass": sh.laws.Parameter("kg", "mass")}

        def slip_limit(self, frequency, values):
            load = values["normal_load"] + values["damper_mass"] * frequency**2
            return values["friction_coefficient"] * load

    values = dict(contact_stiffness=1e4, friction_coefficient=0.3, normal_load=0.0)
    problem = one(Pressed(), damper_mass=1e-4, **values)
    sh.frf(problem, (10, 20), over={"friction_coefficient": [0.2, 0.3]}, progress=False)
    assert not recwarn.list
    nothing = one(sh.laws.Coulomb(), **values)
    with pytest.warns(UserWarning, match="friction_coefficient has no effect, as normal_load is 0"):
        sh.frf(nothing, (10, 20), over={"friction_coefficient": [0.2, 0.3]}, progress=False)
