"""Programs are timed once they have compiled, and the compiled loop finds the same responses."""

import numpy as np
import pytest

import symhbm as sh
from symhbm.numerics import FourierBasis
from tests.benchmarks import clock, contacts, problems

SAMPLES = 2080


def test_compilation_is_not_timed(monkeypatch):
    now, calls = [0.0], {"slow to compile": 0, "fast": 0, "always slow": 0}
    monkeypatch.setattr(clock.time, "process_time", lambda: now[0])

    def program(name, first, later):
        def run():
            now[0] += later if calls[name] else first
            calls[name] += 1
            return name

        return lambda: run

    timed = clock.take_turns(
        {
            "slow to compile": program("slow to compile", 28.0, 0.25),
            "fast": program("fast", 0.5, 0.5),
            "always slow": program("always slow", 10.0, 10.0),
        },
        rounds=3,
    )
    assert {name: measured.seconds for name, measured in timed.items()} == {
        "slow to compile": 0.25,
        "fast": 0.5,
        "always slow": 10.0,
    }
    assert calls == {"slow to compile": 4, "fast": 4, "always slow": 2}


@pytest.mark.slow  # numba compiles for some 20 s
@pytest.mark.parametrize(
    ("problem", "band"),
    [
        (problems.blade(3), problems.BLADE_BAND),
        (problems.ring((1, 3), 100), problems.RING_BAND),
        (problems.shrouded(3, 4), problems.SHROUD_BAND),
    ],
    ids=["blade", "ring", "shrouds"],
)
def test_compiled_loop_agrees(problem, band):
    pytest.importorskip("numba", reason="numba, which compiles the loop, is not installed")
    from tests.benchmarks import aft, arclength

    found = arclength.response(aft.system_of(problem, SAMPLES), band)
    assert found.complete
    at = sh.frf(problem, band, at=found.frequency, progress=False)
    # Sampling moves each switching angle by up to a step; the force, quadratic there, by its square
    # over the period: the tolerance is ten times that.
    tolerance = 10 * (2 * np.pi / SAMPLES) ** 2
    amplitude = at.amplitude if "solution" not in at.dims else at.amplitude.isel(solution=0)
    error = np.abs(amplitude.transpose("frequency", "dof").values - found.amplitude)
    assert error.max() < tolerance * float(at.amplitude.max())
    peak = sh.frf(problem, band, progress=False)
    assert found.peak_amplitude == pytest.approx(float(peak.peak_amplitude.max()), rel=tolerance)


@pytest.mark.slow  # numba compiles for some 20 s
def test_sampled_contacts_agree():
    """Both loops are one law, their error is of first order, their Jacobian is exact."""
    pytest.importorskip("numba", reason="numba, which compiles the loops, is not installed")
    from tests.benchmarks import pressing

    basis = FourierBasis((0, 1, 2, 3))
    motions = contacts.motions_of(basis, 20)
    exact = contacts.whole(basis, contacts.located(basis, motions)()[0])
    values = np.column_stack([contacts.values_of(20)[name] for name in contacts.VALUES])
    error = []
    for n in (256, 4096):
        samples, found = pressing.samples_of(basis, n), []
        for loop in (pressing.by_samples, pressing.by_runs):
            force, slope = np.empty(motions.shape), np.empty((*motions.shape, motions.shape[1]))
            loop(samples, motions, values, force, slope)
            found.append((force, slope))
        (force, slope), other = found
        np.testing.assert_allclose(other[0], force, rtol=0, atol=1e-13)
        np.testing.assert_allclose(other[1], slope, rtol=0, atol=1e-13)
        error.append(np.abs(force - exact).max())
    assert error[0] < 5e-3
    assert error[1] < error[0] / 8
    step = 1e-7 * np.random.default_rng(3).normal(size=motions.shape)
    sides = np.empty((2, *motions.shape))
    for side, at in zip(sides, (motions + step, motions - step), strict=True):
        pressing.by_runs(samples, at, values, side, slope.copy())
    expected = 2 * np.einsum("nij,nj->ni", found[1][1], step)
    np.testing.assert_allclose(sides[0] - sides[1], expected, rtol=0, atol=1e-10)
