"""Published beams and a published law: beside print, and beside independent values."""

from collections.abc import Iterable
from typing import Any

import numpy as np

import symhbm as sh
from tests.published_cases import TURN, beam, coefficients, frequencies, group, source
from tests.reference import CASES
from tests.validation.comparison import Comparison, compared
from tests.validation.oscillators import INDEPENDENT


def dry_beam(name: str, quick: bool) -> list[Comparison]:
    """The beam on rounded friction over the frequency."""
    given, printed = CASES[name]["model"], CASES[name]["published"]
    mass, stiffness = beam(name)
    (element,) = given["elements"]
    free = np.delete(np.arange(len(mass)), element["dof"])
    damping = 0.02 / frequencies(mass[np.ix_(free, free)], stiffness[np.ix_(free, free)])[0]
    model = sh.Model(mass, damping * stiffness, stiffness, contacts={"rubs": group(element)})
    force = sh.forces.PointForce(given["force"]["dof"], given["force"]["amplitude"])
    points = {point["omega"]: point for point in CASES[name]["independent"]["points"]}
    at, tip = sorted(points), given["force"]["dof"]
    band = 370 / TURN, 110 / TURN
    grid = [omega / TURN for omega in at]
    balance = sh.HarmonicBalance(model, force, range(1, 8, 2))
    found = sh.frf(balance, band, at=grid, progress=False).isel(solution=0)
    sizes = np.hypot(
        *found.coefficient.sel(dof=tip).transpose("component", "frequency", "harmonic").values
    )
    size, rows = np.sqrt((sizes**2).sum(axis=1) / 2), []
    each = np.array([points[omega]["A135"] for omega in at])
    root = np.array([points[omega]["rms"] for omega in at])
    own = float(size[at.index(195)])
    rows += [
        compared("tip, root mean square, 7 frequencies", size, root, 1e-11, INDEPENDENT, unit="m"),
        compared(
            "its harmonics 1, 3 and 5",
            sizes[:, :3],
            each,
            1e-8,
            INDEPENDENT,
            unit="m",
            scale=float(each.max()),
        ),
        compared(
            "tip at 195 rad/s", own, printed["tip_rms"], 2e-3, f"{source(name)}, 8e-4 off", unit="m"
        ),
    ]
    return rows


def tip_spring(name: str, quick: bool) -> list[Comparison]:
    """The first mode below and beyond its internal resonance with the second one."""
    printed, told = CASES[name]["published"], CASES[name]["independent"]
    mass, stiffness = beam(name)
    spring = dict(cubic_stiffness=CASES[name]["model"]["elements"][0]["stiffness"])
    contacts = {"tip": sh.Contacts(sh.laws.CubicSpring(), (len(mass) - 2,), **spring)}
    model = sh.Model(mass, 0 * mass, stiffness, contacts=contacts)

    def omega(harmonics: Iterable[int], amplitudes: Any) -> np.ndarray:
        found = sh.nonlinear_modes(
            sh.HarmonicBalance(model, harmonics=harmonics),
            band=(1e-5, max(amplitudes)), at=amplitudes, place=len(mass) - 2, progress=False,
        )  # fmt: skip
        return TURN * found.frequency.values[:, 0]

    amplitude, expected = np.array(told["backbone"]).T
    linear = frequencies(mass, stiffness)[:3]
    return [
        compared(
            "natural frequencies", linear, told["linear_omega"], 1e-9, INDEPENDENT, unit="rad/s"
        ),
        compared(
            "frequency at nine amplitudes, below and beyond the resonance 5:1",
            omega((1, 3, 5), amplitude),
            expected,
            1e-10,
            INDEPENDENT,
            unit="rad/s",
        ),
        compared(
            "frequency beyond it",
            omega((1, 3, 5), [printed["at_tip_amplitude"]]),
            printed["omega_octave"],
            5e-4,
            source(name),
            unit="rad/s",
        ),
    ]


def rubbing_beam(name: str, quick: bool) -> list[Comparison]:
    """The beam on a slider, at eight forces and frequencies."""
    told, given = CASES[name]["independent"], CASES[name]["model"]
    mass, stiffness = beam(name)
    (element,) = given["elements"]
    held = stiffness.copy()
    held[element["dof"], element["dof"]] += element["stiffness"]
    damping = told["alpha"] * mass + told["beta"] * held
    model = sh.Model(mass, damping, stiffness, contacts={"rubs": group(element)})
    balance, rows = sh.HarmonicBalance(model, sh.forces.PointForce(12), (1, 3, 5)), []
    for point in told["points"]:
        forced = balance.with_parameters(force_amplitude=point["force"])
        x = coefficients(sh.solve(forced, point["omega"] / TURN, throw=True))
        what = f"{point['force']} N, {point['omega']} rad/s: "
        found = [*np.hypot(*x[12].T), np.hypot(*x[element["dof"], 0])]
        expected = [*point["tip_A135"], point["slider_dof_A1"]]
        rows.append(compared(f"{what}tip and slider", found, expected, 5e-6, INDEPENDENT, unit="m"))
    stuck = frequencies(mass, held)[:3]
    return [
        compared("stuck frequencies", stuck, told["omega_stuck"], 1e-10, INDEPENDENT, unit="rad/s"),
        *rows,
    ]


def iwan(name: str, quick: bool) -> list[Comparison]:
    """Sliders in parallel, as many as tmdsimpy takes: the energy of a cycle in closed form."""
    given, rows = CASES[name]["parameters"], []
    table = np.array(CASES[name]["closed_form"]["table"])
    stiffness, slips, share = sliders(given, CASES[name]["derived"], 500)
    whole, limits = np.append(stiffness, share), np.append(slips, CASES[name]["derived"]["phi_max"])
    for reach, _, energy in table[: 1 if quick else None]:
        lost = np.where(limits < reach, 4 * whole * limits * (reach - limits), 0.0).sum()
        contacts = sh.Contacts(
            sh.laws.Coulomb(), [(0,)] * len(whole),
            contact_stiffness=whole, friction_coefficient=1.0, normal_load=whole * limits,
        )  # fmt: skip
        model = sh.Model([[1.0]], [[0.0]], [[1.0]], contacts={"iwan": contacts})
        balance = sh.HarmonicBalance(model, harmonics=(1,))
        found = sh.nonlinear_modes(balance, band=(1e-3 * reach, reach), at=[reach], progress=False)
        mine = float(found.dissipation.sum("contact").values.ravel()[0])
        what = f"energy of a cycle of {reach:.4g} m"
        rows += [
            compared(what, mine, energy, 1e-4, "closed form of infinitely many", unit="J"),
            compared(f"{what}, slider by slider", mine, lost, 1e-9, "closed form", unit="J"),
        ]
    return rows


def sliders(given: dict, derived: dict, count: int) -> tuple[np.ndarray, np.ndarray, float]:
    """Stiffness and reach of sliders of equal steps of reach, and the stiffness of the last one.

    Each has the stiffness and the limit force of its step of the density ``R phi^chi``.
    """
    edges, power = np.linspace(0, derived["phi_max"], count + 1), given["chi"] + 1
    weight = derived["R"] * np.diff(edges**power) / power
    limit = derived["R"] * np.diff(edges ** (power + 1)) / (power + 1)
    return weight, limit / weight, given["kt"] - float(weight.sum())
