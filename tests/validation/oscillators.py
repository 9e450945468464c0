"""Published oscillators of a few masses: beside print, and beside independent values."""

import numpy as np
import xarray as xr
from scipy.optimize import root_scalar

import symhbm as sh
from tests.published_cases import (
    TURN,
    Size,
    band,
    coefficients,
    events,
    on_grid,
    peak,
    problem,
    source,
    swept,
)
from tests.reference import CASES
from tests.time_domain.test_stability_changes import CHANGES, changes_of, state_of
from tests.time_domain.test_stiff_stop import stop_in_time
from tests.validation.comparison import Comparison, compared
from tests.validation.sampled_balance import SampledBalance

INDEPENDENT = "sampled balance in NumPy, not of this repository"
SAMPLED = "sampled balance of the repository, 4096 samples"


def duffing(name: str, quick: bool) -> list[Comparison]:
    """Peaks and folds of an oscillator."""
    told, harmonics = CASES[name]["independent"], range(1, 8, 2)
    found, printed = swept(name, harmonics, Size(0)), CASES[name]["published"]
    size, omega = peak(found)
    rows = [
        compared("peak of the root mean square", size, printed["peak_rms"], 1e-5, source(name)),
        compared("its frequency", omega, printed["peak_omega"], 1e-4, source(name)),
        compared("peak", [size, omega], [told["peak_rms"], told["peak_omega"]], 1e-9, INDEPENDENT),
    ]
    first = peak(swept(name, harmonics, Size(0, 1)))
    expected = told["peak_A1"], told["peak_A1_omega"]
    rows.append(compared("peak of the first harmonic", first, expected, 1e-9, INDEPENDENT))
    folds = events(found, "fold")
    rows.append(compared("folds", folds, told["folds_omega_approx"], 1e-5, INDEPENDENT))
    return rows


def stiff_duffing(name: str, quick: bool) -> list[Comparison]:
    """Both changes of stability are folds."""
    told, printed = CASES[name]["independent"], CASES[name]["published"]
    found = swept(name, range(1, 26, 2), Size(0, 1))
    folds, changes = np.sort(events(found, "fold")), events(found, "fold", *CHANGES)
    expected = told["peak_A1"], told["peak_omega"]
    return [
        compared(
            "changes of stability", len(changes), printed["stability_changes"], 0.0, source(name)
        ),
        compared("of these, folds", len(folds), printed["kinds"].count("fold"), 0.0, source(name)),
        compared("folds", folds, told["folds_omega_approx"], 5e-4, INDEPENDENT),
        compared("peak of the first harmonic", peak(found), expected, 1e-8, INDEPENDENT),
    ]


def stop(name: str, quick: bool) -> list[Comparison]:
    """Peaks of both masses, and the limits of stability beside shooting."""
    printed, told = CASES[name]["published"], CASES[name]["independent"]
    fine, rows = told["samples_8192"], []
    found = swept(name, range(22), Size(0))
    size, omega = peak(found)
    rows += [
        compared(
            "first mass: largest root mean square",
            size,
            printed["peak_rms_dof0"],
            1e-3,
            source(name),
        ),
        compared("its frequency", omega, printed["peak_omega_dof0"], 1e-3, source(name)),
        compared("the same", size, fine["peak_rms_dof0"], 1e-5, f"{INDEPENDENT}, 8192 samples"),
        compared("its frequency", omega, fine["peak_omega"], 5e-5, f"{INDEPENDENT}, 8192 samples"),
        compared(
            "folds above 0.7, 13 with 1024 samples",
            np.sum(events(found, "fold") > 0.7),
            1,
            0.0,
            "one, of located contacts",
        ),
    ]
    if not quick:
        other = peak(swept(name, range(22), Size(1)))
        expected = (fine["peak_rms_dof1"], fine["peak_omega_dof1"])
        rows.append(compared("second mass: peak", other, expected, 1e-5, INDEPENDENT))
        rows += _limits_of_stability(found)
    return rows


def _limits_of_stability(found: xr.Dataset) -> list[Comparison]:
    """Where multipliers of motions that SciPy closes pass the unit circle, near those of a path."""
    motion, rows = stop_in_time(), []
    # The stop just touches at the last change, where exact motions close by do not.
    for (kind, index), near in zip(changes_of(found)[:3], (5e-5, 1e-3, 1e-3), strict=True):
        omega, state = TURN * float(found.frequency[index]), state_of(found.isel(point=index))

        def beyond(shift: float, kind=kind, omega=omega, state=state) -> float:
            values = motion.multipliers(omega * (1 + shift), state)
            doubles = kind == "period doubling"
            return float(-1 - values.real.min() if doubles else np.abs(values).max() - 1)

        exact = omega * (1 + root_scalar(beyond, bracket=(-near, near), xtol=1e-8).root)
        rows.append(compared(kind, omega, exact, 5e-4, "multipliers of motions closed by SciPy"))
    return rows


def two_modes(name: str, quick: bool) -> list[Comparison]:
    """Frequencies of both modes over the amplitude."""
    told, rows = CASES[name]["independent"], []
    given = problem(name, range(1, 10, 2))
    for mode in (1, 2):
        amplitude, omega, other, third = np.array(told[f"mode_{mode}"]).T
        found = sh.nonlinear_modes(
            given, band=(1e-2, amplitude[-1]), at=amplitude, mode=mode - 1, progress=False
        ).isel(solution=0)
        sizes = np.hypot(
            *found.coefficient.transpose("component", "harmonic", "dof", "amplitude").values
        )
        what = f"mode {mode}: "
        rows += [
            compared(f"{what}frequency", TURN * found.frequency.values, omega, 1e-12, INDEPENDENT),
            compared(f"{what}second mass", sizes[0, 1], np.abs(other), 1e-7, INDEPENDENT),
            compared(f"{what}third harmonic", sizes[1, 0], third, 1e-6, INDEPENDENT),
        ]
    return rows


def chain(name: str, quick: bool) -> list[Comparison]:
    """Peaks where both sliders move, and all motions at one frequency beside sampled balances."""
    told, rows = CASES[name]["independent"]["points_H7_1024"], []
    found = on_grid(name, range(8), [point["omega"] for point in told])
    for i, point in enumerate(told):
        x, at = coefficients(found.isel(frequency=i, solution=0)), point["omega"]
        sizes, what = np.hypot(*x[:, 1].T), f"all masses at {at} rad/s"
        rows += [
            compared(f"{what}: first harmonic", sizes, point["A1"], 5e-5, INDEPENDENT),
            compared(f"{what}: mean", x[:, 0, 0], point["A0"], 5e-6, INDEPENDENT, scale=1.0),
        ]
    return rows if quick else [*rows, *_peaks(name), *_all_motions(name)]


def _peaks(name: str) -> list[Comparison]:
    """The largest root mean squares of all masses."""
    printed = CASES[name]["published"]["octave_H7"]["peak_rms"]
    fine, rows = CASES[name]["independent"]["H7_1024"], []
    for dof in (0, 1):
        size, omega = peak(swept(name, range(8), Size(dof)))
        what = f"mass {dof + 1}: largest root mean square"
        rows += [
            compared(what, size, printed[dof], 3e-4, source(name)),
            compared(what, size, fine["peak_rms"][dof], 3e-5, f"{INDEPENDENT}, 1024 samples"),
            compared("its frequency", omega, fine["peak_omega"][dof], 1e-3, INDEPENDENT),
        ]
    expected = fine["second_peak_rms_dof2"], fine["second_peak_omega_dof2"]
    found, what = peak(swept(name, range(8), Size(2))), "mass 3: peak while one slider moves"
    return [*rows, compared(what, found, expected, 1e-4, INDEPENDENT)]


def _all_motions(name: str) -> list[Comparison]:
    """Seven motions at one frequency, and what sliders do that start from rest."""
    omega, printed = 1.6271, CASES[name]["published"]["octave_H7"]
    found = on_grid(name, range(8), [omega, 1.655])
    centred, from_rest = (SampledBalance(name, 7, 4096, from_rest=rest) for rest in (False, True))
    n_motions = int(found.n_solutions[0])
    given = [_flat(found.isel(frequency=0, solution=k)) for k in range(n_motions)]
    near = [centred.near(each, omega) for each in given]
    motion = _flat(found.isel(frequency=1, solution=0))
    for each in np.linspace(1.655, printed["peak_omega"][2], 12):
        motion = from_rest.near(motion, each)
    largest = np.linalg.norm(motion.reshape(3, -1)[2]) / np.sqrt(2)
    few, many = (
        np.sort(events(sh.frf(problem(name, range(n)), band(name), progress=False), "fold"))
        for n in (8, 16)
    )
    what = "folds with harmonics up to 7, beside those up to 15"
    rest = "mass 3 where the print has its largest, sliders from rest in a sampled balance"
    return [
        compared("motions at 1.6271 rad/s", n_motions, 7, 0.0, "one more than folds beside them"),
        compared("all of them, each coefficient", given, near, 3e-6, SAMPLED, scale=1.0),
        compared(what, few, many, 3e-4, "more harmonics"),
        compared(rest, largest, printed["peak_rms"][2], 3e-4, source(name)),
    ]


def _flat(point: xr.Dataset) -> np.ndarray:
    """Coefficients of one solution as a sampled balance has them."""
    x = coefficients(point)
    return np.concatenate([x[:, :1, 0], x[:, 1:].reshape(len(x), -1)], axis=1).ravel()


def evaluation(name: str, quick: bool) -> list[Comparison]:
    """Residual, Jacobian and derivative by the frequency at one given state."""
    told, printed = CASES[name], source(name)
    balance = problem(name, told["harmonics"])
    order = np.arange(27).reshape(3, 9).T.ravel()
    state = np.empty(27)
    state[order] = told["state"]
    at = balance.evaluate(state, told["omega"])
    slopes = np.asarray(
        at.jacobian if isinstance(at.jacobian, np.ndarray) else at.jacobian.toarray()
    )
    slopes = slopes[np.ix_(order, order)].ravel()
    allowed = told["tolerance"]["published_abs"]
    return [
        compared("residual", at.residual[order], told["residual"], allowed, printed, scale=1.0),
        compared("Jacobian", slopes, told["jacobian_row_major_27x27"], allowed, printed, scale=1.0),
        compared(
            "by the frequency",
            at.by_parameter[order],
            told["dR_domega"],
            allowed,
            printed,
            scale=1.0,
        ),
    ]


def van_der_pol(name: str, quick: bool) -> list[Comparison]:
    """A driven cycle is entrained between two Neimark-Sacker points."""
    told = CASES[name]["independent"]
    air = sh.laws.SmoothLaw(lambda y, v, p: p["eta"] * y**2 * v, {"eta": (0.1, "N s m-3")}, [(0,)])
    given = CASES[name]["model"]
    model = sh.Model(given["M"], given["C"], given["K"], contacts={"air": air})
    balance = sh.HarmonicBalance(model, sh.forces.PointForce(), range(1, 16, 2))
    near = 1.2 / TURN, 2.8 / TURN  # beyond it superharmonics make other motions
    found = sh.frf(balance, near, stability=True, progress=False)
    at, exact = events(found, "Neimark-Sacker"), "Liouville: where the mean of x^2 is 0.2"
    return [compared("Neimark-Sacker", at, told["neimark_sacker_omega"], 1e-7, exact, unit="rad/s")]
