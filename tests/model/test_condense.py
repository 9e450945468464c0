"""Condensed structures against the whole ones: the same numbers from fewer equations."""

import numpy as np
import pytest
import scipy.sparse as sp

import symhbm as sh
from symhbm.continuation.correctors.resonance_count import LARGEST_SIZE
from symhbm.model.condensation.pole_residue import PoleResidueFunction, PoleSum
from tests.problems import rub
from tests.refusals import refused

BAND = (7.0, 12.5)
NARROW = (9.2, 10.2)
CONTACT = dict(contact_stiffness=1e3, friction_coefficient=0.5, normal_load=1.0)
TIP = 5
FORCED = 40
ROUND_OFF = 1e-10
"""Of two solutions to 1e-12 of the forces, near resonances that amplify by less than a hundred."""


def grid(n_rows, n_columns, damping, seed=0):
    """Matrices of a plate of masses, unequal, on springs."""
    rng = np.random.default_rng(seed)

    def chain(n):
        return sp.diags_array(
            [-np.ones(n - 1), 2 * np.ones(n), -np.ones(n - 1)], offsets=[-1, 0, 1]
        )

    n = n_rows * n_columns
    rows, columns = sp.eye_array(n_rows), sp.eye_array(n_columns)
    softness = n / 100
    stiffness = 1e4 * softness * (sp.kron(chain(n_rows), columns) + sp.kron(rows, chain(n_columns)))
    stiffness = stiffness + sp.diags_array(200 * rng.uniform(0.5, 1.5, n))
    mass = sp.diags_array(rng.uniform(0.8, 1.2, n))
    viscous = {
        "none": 0 * mass,
        "proportional": 0.2 * mass + 1e-5 * stiffness,
        "local": 0.1 * mass + sp.diags_array(np.where(rng.uniform(size=n) < 0.1, 5.0, 0.0)),
    }[damping]
    return sp.csc_array(mass), sp.csc_array(viscous), sp.csc_array(stiffness)


def plate(damping, gyroscopic=False):
    """A structure of 64 degrees of freedom with four contacts, two of them to the ground."""
    mass, viscous, stiffness = grid(8, 8, damping)
    if gyroscopic:
        skew = sp.diags_array([np.full(60, 1.0), np.full(60, -1.0)], offsets=[4, -4])
        viscous = sp.csc_array(viscous + skew)
    return sh.Model(
        mass,
        viscous,
        stiffness,
        contacts=[(10,), (51,), (14, 47), (TIP, 11)],
        **rub([2500.0, 3000.0, 4900.0, 2600.0], 0.5, [0.8, 0.9, 1.0, 0.8]),
    )


def problems(damping="local", harmonics=(1,), force=None, **options):
    model, force = plate(damping, **options), force or sh.forces.PointForce(FORCED, amplitude=20.0)
    condensed = sh.condense(model, force, BAND, harmonics, places=[FORCED - 9])
    return tuple(sh.HarmonicBalance(m, force, harmonics) for m in (model, condensed))


@pytest.fixture(scope="module")
def pair():
    return problems()


def test_a_band_function_is_the_sum_of_its_poles():
    rng = np.random.default_rng(1)
    natural = np.linspace(1, 300, 120)
    poles = np.concatenate([(-0.001 + 1j) * natural, (-0.001 - 1j) * natural])

    def coefficients(*shape):
        first = rng.normal(size=(3, *shape)) + 1j * rng.normal(size=(3, *shape))
        return first / np.array([1, 10, 100])[:, None, None]

    whole = PoleSum(coefficients(3, 4), coefficients(3, 240), coefficients(240, 4), poles)
    fast = PoleResidueFunction(whole, (6.0, 50.0))
    assert fast.terms.shape[1] == 2 * whole(17.3).size  # read at each frequency: the value's alone
    for s in (6.0, 17.3, 31.0, 50.0):
        value, slope = fast(s)
        np.testing.assert_allclose(value, whole(s), rtol=1e-11)
        step = 1e-5
        between = (whole(s + step) - whole(s - step)) / (2 * step)
        # Differences next to poles of the width 0.001 s.
        np.testing.assert_allclose(slope, between, rtol=1e-4)
        if 6 < s < 50:
            bend = (fast(s + step)[1] - fast(s - step)[1]) / (2 * step)
            np.testing.assert_allclose(fast.curvature(s), bend, rtol=1e-3)
    with pytest.raises(ArithmeticError, match="outside the band"):
        fast(50.1)


def test_a_band_without_a_resonance_of_the_held_structure():
    # The first mode of a chain: what is left once contact and tip are held resonates far above.
    n = 40
    ones = np.ones(n)
    stiffness = sp.diags_array([-ones[1:], 2 * ones, -ones[1:]], offsets=[-1, 0, 1]).tocsc()
    stiffness[-1, -1] = 1.0
    stiffness = stiffness * (2 * np.pi * 6 / (2 * np.sin(np.pi / (4 * n + 2)))) ** 2
    mass = sp.eye_array(n)
    model = sh.Model(mass, 0.5 * mass + 1e-5 * stiffness, stiffness, contacts=[(20,)], **CONTACT)
    force, band = sh.forces.PointForce(n - 1), (4.9, 8.0)
    condensed = sh.condense(model, force, band, places=[n - 1])
    assert condensed.pole_residues[1].poles.size == 0
    one, other = (
        sh.frf(sh.HarmonicBalance(m, force), band, at=[5, 6, 7], progress=False)
        for m in (model, condensed)
    )
    assert other.status == "the end of the band was reached"
    assert other.n_events == 2
    expected = one.coefficient.isel(dof=condensed.dofs).values
    size = np.abs(expected).max()
    np.testing.assert_allclose(other.coefficient / size, expected / size, atol=ROUND_OFF, rtol=0)
    np.testing.assert_allclose(other.peak_amplitude, one.peak_amplitude, rtol=ROUND_OFF)


def test_modes_below_a_fixed_frequency_are_those_of_the_whole(pair):
    whole, small = (problem.model for problem in pair)
    springs = whole.groups.stuck_springs
    (low, high), fixed = 2 * np.pi * np.array(BAND), small.fixed[1][0]
    within = fixed[(fixed > low) & (fixed < high)].tolist()
    counts = [[model.modes_below(1, s, springs) for s in within] for model in (whole, small)]
    assert counts[0] == counts[1] != []


def test_the_distance_from_the_whole_is_within_the_certificate_and_told(pair):
    whole, small = pair
    kept, certificate = small.model.dofs, small.model.certificate
    for hertz in (7.6, 8.7, 9.8, 10.9):
        point = sh.solve(small, hertz)
        exact = sh.solve(whole, hertz).coefficient.values[kept]
        error = np.linalg.norm(point.coefficient.values - exact) / np.linalg.norm(exact)
        assert error < 10 * max(certificate.error, certificate.friction_bound) < ROUND_OFF * 10
        off = point.assign(coefficient=(1 + 1e-6) * point.coefficient)
        told = sh.datasets.recover(small, off).condensation_error
        assert float(told) == pytest.approx(1e-6, rel=0.1)


def test_undamped_stiffness_is_that_of_a_structure_without_damping():
    small = problems("none")[1].model
    for s in 2 * np.pi * np.linspace(*BAND, 5):
        whole, slope = (part[:, : small.n_dof] for part in small.pole_residues[1](s))
        for found, known in zip(small.undamped[1](s), (whole, slope), strict=True):
            np.testing.assert_allclose(found, known, rtol=0, atol=1e-9 * abs(known).max())


def test_narrow_resonances_of_what_was_eliminated_are_seen(monkeypatch):
    # Three small resonators hang on a heavy mass: at no step do they show in its motion.
    mass, damping, stiffness = np.diag([1.0, 1e-5, 1e-5, 1e-5]), np.zeros((4, 4)), np.zeros((4, 4))
    stiffness[0, 0], damping[0, 0] = 1e4, 1.0
    for i, frequency in enumerate(2 * np.pi * np.array([3.0, 4.4, 6.2]), start=1):
        direction = np.eye(4)[0] - np.eye(4)[i]
        stiffness += 1e-5 * frequency**2 * np.outer(direction, direction)
        damping += 2e-9 * frequency * np.outer(direction, direction)
    model = sh.Model(mass, damping, stiffness, contacts=[(0,)], **CONTACT)
    force = sh.forces.PointForce(0, amplitude=2.0)
    whole = sh.frf(sh.HarmonicBalance(model, force), (2, 8), peaks="each", progress=False)
    condensed = sh.HarmonicBalance(sh.condense(model, force, (2, 8)), force)
    response = sh.frf(condensed, (2, 8), progress=False)
    expected = whole.peak_frequency[whole.peak_dof == 0]
    assert len(expected) == 3
    np.testing.assert_allclose(response.peak_frequency, expected, rtol=1e-9)
    assert LARGEST_SIZE > 1
    monkeypatch.setattr("symhbm.continuation.events.modes.LARGEST_SIZE", 0)
    assert sh.frf(condensed, (2, 8), progress=False).n_peaks == 0


def test_what_is_largest_is_told_to_be_of_what_is_kept(pair, tmp_path):
    from click.testing import CliRunner

    from symhbm.cli import main

    problem = pair[1]
    kept = f"{problem.n_dof} degrees of freedom kept of 64"
    assert f"the largest response is that of these {problem.n_dof}" in repr(problem.model)
    response = sh.frf(problem, NARROW, progress=False)
    assert response.attrs["largest_of"] == kept
    for name in ("peak_amplitude", "peak_dof"):
        assert response[name].attrs["long_name"].endswith(f", of the {kept}")
    path = tmp_path / "kept.nc"
    sh.save(response, path)
    assert sh.load(path).equals(response)
    told = CliRunner().invoke(main, ["info", str(path)]).output
    assert f"of the {kept}" in " ".join(told.split())
    axes = sh.plot.response(response).axes[0]
    assert axes.get_ylabel() == f"largest response of {problem.n_dof} kept DOFs [dB re 1 m]"
    axes = sh.plot.response(response, place=1).axes[0]
    assert axes.get_ylabel().startswith(f"response of DOF {problem.model.dofs[1]} (kept DOF 1)")
    whole = sh.frf(pair[0], (9.9, 10.0), progress=False)
    assert "largest_of" not in whole.attrs
    assert "kept" not in whole.peak_amplitude.attrs["long_name"]


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda p: sh.frf(p, (6, 9)), ValueError, r"band=.*7 to 12.5 Hz"),
        (lambda p: sh.solve(p, 20.0), ValueError, r"frequency=20.0: .* condense it"),
        (lambda p: sh.follow(p, "normal_load", (1, 2), frequency=3), ValueError, "7 to 12.5"),
        (lambda p: sh.frf(p, (8, 9), accuracy=1e-2), ValueError, r"harmonics=\(1, 3, 5\) at least"),
        (lambda p: sh.frf(p, (8, 9), stability=True), ValueError, "condense it with stability="),
        (lambda p: sh.frf(p, (8, 9), over={"mass": [1]}), KeyError, "'mass' is no parameter"),
        (lambda p: sh.periodic_motion(p, 8.0), TypeError, "symhbm.craig_bampton reduces"),
        (lambda p: sh.peak_curve(p, "normal_load", (1, 2), frequency_band=(5, 8)),
         ValueError, "7 to 12.5"),
        (lambda p: sh.minimise_peak(p, "normal_load", (1, 2), frequency_band=(5, 8)),
         ValueError, "7 to 12.5"),
        (lambda p: sh.SwitchingAngles(p), TypeError, "no such CasADi function"),
        (lambda p: p.derivative("frequency"), TypeError, "use evaluate"),
        (lambda p: p.model.mass_matrix, TypeError, "attribute structure"),
        (lambda p: sh.HarmonicBalance(p.model, sh.forces.PointForce(3)),
         ValueError, "freedom 3.; give"),
        (lambda p: sh.HarmonicBalance(p.model, p.excitation, (1, 3)),
         ValueError, r"harmonics=\(1, 3\): .*condensed for, \(1,\)"),
        (lambda p: sh.condense(p.model, p.excitation, BAND), TypeError, "not condensed"),
        (lambda p: sh.datasets.recover(p, sh.solve(p, 8.0).drop_vars("coefficient")),
         ValueError, "point:"),
    ],
)  # fmt: skip
def test_what_it_cannot_do_says_so(pair, call, error, message):
    with pytest.raises(error, match=message):
        call(pair[1])


def condensed(**changes):
    given = dict(model=plate("local"), excitation=sh.forces.PointForce(FORCED))
    return sh.condense(**given | dict(frequency_band=(8, 9)) | changes)


test_bad_input_names_its_argument = refused([
    (lambda: condensed(model=3), TypeError, "model=3"),
    (lambda: condensed(excitation=3), TypeError, "excitation=3"),
    (lambda: condensed(excitation=[]), ValueError, "excitation"),
    (lambda: condensed(frequency_band=(5,)), ValueError, r"frequency_band=\(5,\)"),
    (lambda: condensed(frequency_band=(0, 5)), ValueError, "frequency_band"),
    (lambda: condensed(harmonics=(2,)), ValueError, "harmonic 1"),
    (lambda: condensed(places=[64]), ValueError, "places=64"),
    (lambda: condensed(places=3), TypeError, "places=3"),
    (lambda: condensed(places=range(64)), ValueError, "nothing is left"),
    (lambda: condensed(tolerance=1e-20), ValueError, "responses are exact to"),
])  # fmt: skip


def test_an_interior_that_floats_is_refused():
    stiffness = np.diag([1.0, 1.0, 0.0])
    none = dict(contact_stiffness=0, friction_coefficient=0, normal_load=0)
    model = sh.Model(np.eye(3), 0 * stiffness, stiffness, contacts=[(0,)], **none)
    with pytest.raises(ValueError, match="add to places one of each part"):
        sh.condense(model, sh.forces.PointForce(0), (0.1, 0.2))
    assert sh.condense(model, sh.forces.PointForce(0), (0.1, 0.2), places=[2]).n_dof == 2
