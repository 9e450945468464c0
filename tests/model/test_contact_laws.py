"""Contact laws of a user's own, and groups of contacts by name, through every verb."""

from pathlib import Path

import casadi as ca
import numpy as np
import pytest

import symhbm as sh
from symhbm.model.contacts import Motions, graph_of
from symhbm.numerics import RADIANS, FourierBasis
from symhbm.results.archive import ArchiveError
from tests.problems import Coupled, rub
from tests.quick import quick_first
from tests.refusals import refused


class SoftStop(Coupled):
    """The same under a name that no other test asks for."""


class PressedDamper(sh.laws.Coulomb):
    """A damper of engine order 3 that centrifugal force presses against its blades."""

    parameters = sh.laws.Coulomb.parameters | {
        "damper_mass": sh.laws.Parameter("kg", "mass of the damper", "$m_d$", designed=True)
    }

    variables = {"pressing_force": ("N", "force that presses the contact")}  # noqa: RUF012

    def results(self, at, located):
        pressed = self.slip_limit(at.frequency, at.values) / at.values["friction_coefficient"]
        own = {"pressing_force": np.broadcast_to(pressed, len(at.motion))}
        return super().results(at, located) | own

    def slip_limit(self, frequency, values):
        load = values["normal_load"] + 0.4 * values["damper_mass"] * (frequency / 3) ** 2
        return values["friction_coefficient"] * load


def pressed(harmonics=(1, 3), mass=4e-3, load=1.0):
    damper = sh.Contacts(PressedDamper(), [(0, 1)], **rub(1e4, 0.3, load), damper_mass=mass)
    root = sh.Contacts(sh.laws.Coulomb(), [(0,), (1,)], **rub(4e3, 0.4, [30.0, 35.0]))
    model = sh.Model(
        np.eye(2), 0.5 * np.eye(2), np.diag([1e4, 1.2e4]), contacts={"damper": damper, "root": root}
    )
    return sh.HarmonicBalance(model, sh.forces.PointForce(), harmonics)


def test_the_limit_of_a_damper_follows_its_speed():
    """At each frequency the response is that of the same element with its load there."""
    problem = pressed()
    response = sh.frf(problem, (14, 24), at=np.linspace(14, 24, 9), progress=False)
    force = 1.0 + 0.4 * 4e-3 * (RADIANS * response.frequency.values / 3) ** 2
    np.testing.assert_allclose(response.pressing_force.isel(contact=0).values, force, rtol=1e-12)
    assert np.isnan(response.pressing_force.isel(contact=[1, 2]).values).all()
    assert response.pressing_force.attrs["units"] == "N"
    for point in response.transpose("frequency", ...).frequency.values:
        omega = RADIANS * point
        load = 1.0 + 0.4 * 4e-3 * (omega / 3) ** 2
        plain = problem.with_parameters(**{"damper_mass": 0.0, "damper.normal_load": load})
        expected = sh.solve(plain, point).amplitude.values
        amplitude = response.amplitude.sel(frequency=point).values.ravel()[: len(expected)]
        np.testing.assert_allclose(amplitude, expected, rtol=1e-9)


class WithoutCurvature(sh.laws.Coulomb):
    """A law that does not tell how its events move."""

    moving = sh.laws.ContactLaw.moving


def stop_of_the_docs():
    """The law that the page on extending writes, an event for each touch."""
    page = (Path(__file__).parents[2] / "docs" / "extending.md").read_text()
    place = page.index("class Stop(sh.laws.ContactLaw)")
    first, last = page.rindex("```python", 0, place), page.index("blade = ", place)
    names = {}
    exec(page[first + len("```python") : last], names)
    return names["Stop"]()


@pytest.mark.slow
@pytest.mark.parametrize("name", quick_first(["gap", "stop_stiffness"], 1))
def test_a_law_of_the_user_has_second_derivatives(name):
    """Slopes of the frequency of a peak need them: against peaks beside it."""
    law, values = stop_of_the_docs(), dict(stop_stiffness=2e4, gap=5e-4)

    def peak(step):
        moved = values | {name: values[name] * (1 + step)}
        stop = sh.Contacts(law, [(0,)], **moved)
        blade = sh.Model([[1.0]], [[5.0]], [[1e4]], contacts={"stop": stop})
        problem = sh.HarmonicBalance(
            blade, sh.forces.PointForce(amplitude=1.0), harmonics=(1, 3, 5)
        )
        return sh.frf(problem, (10, 30), progress=False)

    found = sh.datasets.sensitivity(peak(0.0), laws=[law])
    up, down = (peak(step) for step in (1e-4, -1e-4))
    for of in ("frequency", "amplitude"):
        change = (up[f"peak_{of}"].item() - down[f"peak_{of}"].item()) / 2e-4 / values[name]
        slope = float(found[f"peak_{of}_by_{name}"].values.item())
        assert slope == pytest.approx(change, rel=1e-5)


def test_second_derivatives_say_what_a_law_does_not_tell():
    group = sh.Contacts(
        WithoutCurvature(), [(0,)], contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3
    )
    blade = sh.Model([[1]], [[0.5]], [[1e4]], contacts={"damper": group})
    response = sh.frf(sh.HarmonicBalance(blade, sh.forces.PointForce()), (10, 30), progress=False)
    message = r"WithoutCurvature\(\): expected a method moving, second derivatives of its force"
    with pytest.raises(NotImplementedError, match=message):
        sh.datasets.sensitivity(response, laws=[WithoutCurvature()])


def test_a_name_of_several_groups_is_refused():
    problem = pressed()
    assert "damper.normal_load" in problem.parameters
    assert "normal_load" not in problem.parameters
    both = "several groups; say damper.normal_load or root.normal_load"
    calls = (
        lambda: problem.with_parameters(normal_load=3.0),
        lambda: sh.frf(problem, (10, 30), over={"normal_load": [1, 2]}, progress=False),
        lambda: sh.follow(problem, "normal_load", (1, 10), frequency=19, progress=False),
        lambda: sh.minimise_peak(problem, "normal_load", frequency_band=(10, 30), bounds=(1, 10)),
        lambda: sh.mistuning.uniform(problem, 3, seed=0, normal_load=0.1),
    )
    for call in calls:
        with pytest.raises(KeyError, match=both):
            call()
    # The name with its group may be said where it need not be.
    assert problem.with_parameters(**{"damper.damper_mass": 1e-3}).parameters["damper_mass"] == 1e-3
    swept = sh.frf(problem, (18, 20), over={"damper.damper_mass": [1e-3]}, progress=False)
    assert "damper_mass" in swept.coords


def test_an_archive_names_the_law_it_lacks(tmp_path):
    blade = sh.Model(np.eye(2), np.eye(2), 1e4 * np.eye(2), {"stop": soft([(0,)], [(1,)])})
    problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    response = sh.frf(problem, (14, 15), progress=False)
    sh.save(response, tmp_path / "law.nc")
    loaded = sh.load(tmp_path / "law.nc")
    assert sh.datasets.rebuild(loaded).model.groups[0].law == SoftStop()  # it is defined here
    elsewhere = loaded.attrs["problem"].replace('"SoftStop"', '"HardStop"')
    elsewhere = loaded.assign_attrs(problem=elsewhere)
    for call in (
        sh.datasets.rebuild,
        sh.datasets.sensitivity,
        lambda d: sh.verify(d, progress=False),
    ):
        with pytest.raises(ArchiveError, match=r"computed with HardStop \(group 'stop'\)"):
            call(elsewhere)

    class Other(SoftStop):
        parameters = {"else": sh.laws.Parameter("N", "something else")}  # noqa: RUF012

    Other.__name__ = "SoftStop"
    with pytest.raises(ArchiveError, match="expected SoftStop with the parameters hardening"):
        sh.datasets.rebuild(loaded, laws=[Other()])
    with pytest.raises(TypeError, match="laws: expected contact laws, got"):
        sh.datasets.rebuild(loaded, laws=[SoftStop])


def one_mass(contacts, **values):
    return sh.Model([[1]], [[1]], [[1]], contacts=contacts, **values)


def soft(*directions):
    return sh.Contacts(SoftStop(), *directions, hardening=1.0)


test_bad_groups_say_what_is_expected = refused([
    (lambda: sh.Contacts("Coulomb", [(0,)]), TypeError, "law='Coulomb': expected a"),
    (lambda: sh.Contacts(SoftStop(), [(0,)]), ValueError, "tangential, across, got 1"),
    (lambda: sh.Contacts(sh.laws.Coulomb(), [(0,)]), ValueError, "expected a value"),
    (lambda: sh.Contacts(SoftStop(), [(0,)], [(0,)], stiffness=1.0),
     KeyError, "is no parameter of SoftStop"),
    (lambda: soft([(0,)], [(0,), (1,)]), ValueError, "expected as many in each direction"),
    (lambda: one_mass({"a": [(0,)]}), TypeError, r"contacts\['a'\]"),
    (lambda: one_mass({"a": soft([(0,)], [(1,)])}), ValueError, "from 0 to 0"),
    (lambda: one_mass({"a b": soft([(0,)], [(0,)])}), ValueError, "'a b' is no name"),
    (lambda: one_mass({"a": soft([(0,)], [(0,)])}, normal_load=3),
     ValueError, "normal_load: expected the values of named groups"),
])  # fmt: skip


def test_events_have_the_words_of_their_law():
    class Pair(sh.laws.Coulomb):
        switches = (sh.laws.Switch("slip", "begins to rub", "rests"),)

    values = dict(contact_stiffness=1e4, friction_coefficient=0.3, normal_load=2.0)
    matrices = np.eye(2), 0.5 * np.eye(2), np.diag([1e4, 1.2e4])
    kinds = []
    for law in (Pair(), sh.laws.Coulomb()):
        model = sh.Model(*matrices, contacts={"rub": sh.Contacts(law, [(0, 1)], **values)})
        problem = sh.HarmonicBalance(model, sh.forces.PointForce(), (1, 3))
        kinds.append(sh.frf(problem, (12, 30), progress=False).event_kind.values.tolist())
    own, plain = kinds
    assert len(plain) >= 2
    words = {"onset of slip": "begins to rub", "end of slip": "rests"}
    assert own == [words[kind] for kind in plain]


class Twisted(sh.laws.PolynomialLaw):
    """Each displacement pushes the other, differently."""

    directions = ("first", "second")
    parameters = {"cross": sh.laws.Parameter("N m-1", "cross stiffness", bound="any")}  # noqa: RUF012
    degree, odd = 4, False

    def force_at(self, displacement, frequency, values):
        first, second = displacement[0], displacement[1]
        forces = second + first**3 * second, frequency * second**2 - first / 3
        return values["cross"] * ca.vertcat(*forces)


@pytest.mark.parametrize("harmonics", [(1,), (0, 1, 2, 5), (1, 3, 5), (2, 6)])
def test_slopes_from_series_are_the_derivative(harmonics):
    """CasADi's own derivative of the integrals, entry by entry."""
    law, basis = Twisted(), FourierBasis(harmonics)
    at, symbols = Motions.symbols(law, basis)
    force = law.force(at, ca.SX())
    outputs = [law.slope(at, force), ca.jacobian(force, at.motion)]
    both = ca.Function("both", symbols, outputs)
    numbers = np.random.default_rng(1).normal(size=at.motion.numel())
    found, expected = (np.array(part) for part in both(numbers, 1.3, 0.7))
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-13 * np.abs(expected).max())


@pytest.mark.slow
def test_many_harmonics_of_a_polynomial_take_few_operations():
    """Products of waves would be 62 x 62 x 125 multiplications."""
    basis = FourierBasis(tuple(range(32)))
    assert graph_of(sh.laws.CubicSpring(), basis).force.n_instructions() < 120_000


class Fifth(sh.laws.PolynomialLaw):
    """A bush of the fifth power."""

    directions = ("bend",)
    parameters = {"bush_stiffness": sh.laws.Parameter("N m-5", "stiffness of the bush")}  # noqa: RUF012
    degree = 5

    def force_at(self, displacement, frequency, values):
        return values["bush_stiffness"] * displacement**5


def test_pictures_draw_a_law_of_the_user_without_memory():
    bush = sh.Contacts(Fifth(), [(0,)], bush_stiffness=1e12)
    blade = sh.Model([[1.0]], [[5.0]], [[1e4]], contacts={"bush": bush})
    problem = sh.HarmonicBalance(blade, sh.forces.PointForce(), (1, 3))
    sh.plot.model(problem.model)
    for result in (sh.solve(problem, 15.0), sh.periodic_motion(problem, 15.0)):
        line = max(sh.plot.hysteresis(result).axes[0].lines, key=lambda one: len(one.get_xdata()))
        power = np.polyfit(*np.log(np.abs([line.get_xdata(), line.get_ydata()]) + 1e-300), 1)[0]
        assert power == pytest.approx(5)
