"""Comparisons with closed forms, exact motions in time, and stored motions of other programs."""

import json
from functools import partial

import numpy as np

import symhbm as sh
from studies import fig03_single_blade as fig03
from studies import fig08_engine_orders as fig08
from studies.closed_form import OneBlade, StuckRing
from symhbm.model.contacts import Motions
from symhbm.model.contacts.coulomb.located import locate
from symhbm.numerics import FourierBasis
from tests.pressed_contact import gap_stop, inclined, reference, solved, two_blades, two_way
from tests.published import duffing, duffing_problem
from tests.reference import EXACT, PRESSED, STATED
from tests.validation.comparison import Comparison, Part, compared, computed

CLOSED, MARCHED = "closed form, extended precision", "exact motion, event by event"
OTHER = "exact motion, another program of our own"
EQUATIONS = "source, Eqs. (6)-(8), closed form"
COULOMB_ONLY = dict(mass=1, stiffness=1e4, damping=0.5, friction_coefficient=0.5, normal_load=100)


def parts(quick: bool) -> list[Part]:
    """All of them, or a few of the points of each."""
    return [
        computed(
            "Contact force",
            "Force coefficients of one contact for given motions, without any solution.",
            contact_force,
        ),
        computed(
            "Linear structure",
            "Natural frequencies of the disk whose contacts all stick, and its response.",
            linear,
        ),
        computed(
            "Peaks under one harmonic",
            "Where two frequencies of one amplitude merge: closed forms in the amplitude.",
            partial(peaks, quick),
        ),
        computed(
            "Nonlinear modes in closed form",
            "Duffing oscillators by elliptic integrals, one harmonic of a blade that rubs.",
            modes,
        ),
        computed(
            "Exact motions under constant normal loads",
            "Periodic motions found by `periodic_motion` from event to event, beside stored ones.",
            partial(constant_loads, quick),
        ),
        computed(
            "Exact motions under normal loads that move",
            "Contacts that slip, open and close, beside motions of other programs.",
            partial(moving_loads, quick),
        ),
        computed(
            "Harmonic balance beside exact motions",
            "Responses recomputed from their datasets by `verify`, and truncation as the "
            "documents state it.",
            partial(balance, quick),
        ),
    ]


def contact_force() -> list[Comparison]:
    """Eqs. (6) to (8), and a motion with six reversals."""
    table = EXACT["describing_function"]
    stiffness, limit = np.array([table["kd"]], float), np.array([table["muFn"]])
    basis, found, expected = FourierBasis((1, 3, 5)), [], []
    angles = [], []
    for row in table["rows"]:
        motion = np.zeros(basis.n_components)
        motion[basis.component(1)] = float(row["A"])
        at = locate(basis, motion[None], stiffness, limit)
        force = stiffness * at.matrix[0] @ motion + limit * at.vector[0]
        for n in basis.harmonics:
            found += [force[basis.component(n)], force[basis.component(n, True)]]
            expected += [float(row[f"fc{n}"]), float(row[f"fs{n}"])]
        if row["theta_star"] is not None:
            angles[0].append(at.theta_star[0])
            angles[1].append(float(row["theta_star"]))
    loop, basis = EXACT["jenkins_minor_loop"], FourierBasis((1, 3))
    motion = np.column_stack([loop["y_a"], loop["y_b"]]).ravel()
    stiffness, limit = np.array([loop["kd"]], float), np.array([loop["muFn"]])
    at = locate(basis, motion[None], stiffness, limit)
    force = stiffness * at.matrix[0] @ motion + limit * at.vector[0]
    loop_force = np.column_stack([loop["f_a"], loop["f_b"]]).ravel()
    slip, six = 1 - at.stick_fraction[0], loop["reversals"]
    return [
        compared(
            "force coefficients, harmonics 1, 3, 5, over the limit force",
            found,
            expected,
            1e-12,
            EQUATIONS,
            unit="N",
            scale=table["muFn"],
        ),
        compared("angle where slip begins", *angles, 1e-12, EQUATIONS, unit="rad"),
        compared("six reversals: force coefficients", force, loop_force, 1e-10, MARCHED, unit="N"),
        compared("six reversals: their number", at.reversals[0], six, 0.0, MARCHED),
        compared("six reversals: share of slip", slip, loop["slip_fraction"], 1e-11, MARCHED),
        *_forces_under_moving_loads(),
    ]


def _forces_under_moving_loads() -> list[Comparison]:
    law, basis, rows = sh.laws.VariableLoadFriction(), FourierBasis((0, 1, 2)), []
    names = "contact_stiffness", "normal_stiffness", "friction_coefficient", "normal_load"
    for name, (numbers, u, v, tangential, *_) in STATED["explicit_motions"].items():
        values = {key: np.array([value], float) for key, value in zip(names, numbers, strict=True)}
        motion = np.array([*u, *v], float)
        at = Motions(basis, motion[None], 1.0, values)
        force = law.forces(at, law.locate(at))[0][: basis.n_components]
        what = f"normal load that moves, {name}: tangential force"
        source = "two independent programs of our own"
        rows.append(compared(what, force, tangential, 2e-12, source, unit="N", scale=1.0))
    return rows


def linear() -> list[Comparison]:
    """The ring whose contacts stick, beside closed forms."""
    rows = []
    for stiffness, hertz in EXACT["ring_natural_hz"].items():
        ring = sh.bladed_disk(13, **COULOMB_ONLY | {"contact_stiffness": float(stiffness)})
        single = np.array([float(one) for one in hertz])
        expected = np.sort(np.concatenate([single, single[1:]]))
        found = np.sort(np.ravel(sh.natural_modes(ring, count=13, stuck=True).frequency.values))
        what = f"natural frequencies of the stuck ring, k_d = {float(stiffness):g} N/m"
        rows.append(compared(what, found, expected, 1e-10, CLOSED, unit="Hz"))
    ring = StuckRing(13, 1.0, 0.5, 1e4, 1e6, 1.0)
    held = sh.bladed_disk(13, **COULOMB_ONLY | dict(contact_stiffness=1e6, normal_load=1e7))
    at = sh.frf(
        sh.HarmonicBalance(held, sh.forces.PointForce(0)), (70, 90), at=[75.0], progress=False
    )
    what, expected = "response of the stuck ring to a point force, 75 Hz", ring.response(75.0)
    found = at.amplitude.values[0]
    return [*rows, compared(what, found, np.abs(expected), 1e-10, "NumPy, dense", unit="m")]


def peaks(quick: bool) -> list[Comparison]:
    """Peaks of the blade and of the tuned ring."""
    loads = [row["Fn"] for row in EXACT["single_blade_peaks"]][:: 3 if quick else 1]
    found = sh.frf(fig03.problem(), fig03.BAND, over={"normal_load": loads}, progress=False)
    stored = {row["Fn"]: row for row in EXACT["single_blade_peaks"]}
    rows, own = [], "closed form, of the stored values and solved anew"
    for load in loads:
        at = found.sel(normal_load=load)
        blade = OneBlade(1.0, 0.5, 1e4, 1e4, 0.5 * load, 1.0, 1.0)
        sizes, places = (at[name].values[0] for name in ("peak_amplitude", "peak_frequency"))
        amplitude, frequency = blade.peak()
        table = float(stored[load]["hbm1_peak_X"]), float(stored[load]["hbm1_peak_hz"])
        what = f"one blade, F_n = {load:g} N: peak"
        rows += [
            compared(f"{what} amplitude", [sizes] * 2, [table[0], amplitude], 1e-9, own, unit="m"),
            compared(
                f"{what} frequency", [places] * 2, [table[1], frequency], 1e-9, own, unit="Hz"
            ),
        ]
    orders = [case["EO"] for case in EXACT["ring_EO_1_3_6_Fn100"]]
    problem = fig08.problem().with_parameters(normal_load=100.0)
    found = sh.frf(problem, fig08.BAND, over={"engine_order": orders}, progress=False)
    for case in EXACT["ring_EO_1_3_6_Fn100"]:
        at, what = found.sel(engine_order=case["EO"]), f"ring, EO {case['EO']}, 100 N: peak"
        size, hertz = float(case["hbm1_peak_X"]), float(case["hbm1_peak_hz"])
        rows += [
            compared(
                f"{what} amplitude", at.peak_amplitude.values[0], size, 1e-9, CLOSED, unit="m"
            ),
            compared(
                f"{what} frequency", at.peak_frequency.values[0], hertz, 1e-9, CLOSED, unit="Hz"
            ),
        ]
    return rows


def modes() -> list[Comparison]:
    """Frequencies of free motions over their amplitude."""
    rows = []
    for kind, cubic, largest in (("hardening", 0.5, 3.0), ("softening", -0.5, 1.2)):
        problem = duffing_problem(cubic)
        found = sh.nonlinear_modes(problem, band=(1e-2, largest), progress=False)
        expected = duffing(1.0, cubic, found.largest_displacement.values[:, 0])
        omega = 2 * np.pi * found.frequency.values
        what = f"{kind} oscillator of Duffing: frequency"
        rows.append(compared(what, omega, expected, 1e-9, "elliptic integral", unit="rad/s"))
    return rows


def constant_loads(quick: bool) -> list[Comparison]:
    """Stored exact motions of the blade and of the ring."""
    rows = []
    for point in EXACT["single_blade_points"][:: 5 if quick else 1]:
        problem = fig03.problem().with_parameters(normal_load=point["Fn"])
        highest = len(point["a"])
        motion = sh.periodic_motion(
            problem, point["freq_hz"], harmonics=range(1, highest + 1), throw=True
        )
        expected = np.stack([np.array(point[key])[:, 0] for key in "ab"], axis=-1)
        what = f"blade, {point['Fn']:g} N, {point['freq_hz']:g} Hz"
        rows += [
            compared(
                f"{what}: coefficients, over the largest",
                motion.coefficient.transpose("dof", "harmonic", "component").values[0],
                expected,
                1e-10,
                MARCHED,
                unit="m",
                scale=float(np.abs(expected).max()),
            ),
            compared(
                f"{what}: share of slip",
                1 - motion.stick_fraction.values,
                point["slip_fraction"],
                1e-9,
                MARCHED,
                scale=1.0,
            ),
        ]
    for case in EXACT["ring_EO_1_3_6_Fn100"][:: 2 if quick else 1]:
        given = dict(normal_load=case["Fn"], engine_order=case["EO"])
        problem = fig08.problem().with_parameters(**given)
        for point in case["points"]:
            motion = sh.periodic_motion(problem, point["freq_hz"], throw=True)
            expected = np.full(motion.amplitude.size, point["x_max_abs"])
            what = f"ring, EO {case['EO']}, {point['freq_hz']:g} Hz: amplitudes of all blades"
            found = motion.amplitude.values
            rows.append(compared(what, found, expected, 1e-9, MARCHED, unit="m"))
    return rows


def moving_loads(quick: bool) -> list[Comparison]:
    """Motions of contacts that open: coefficients, energy, sizes that others state."""
    rows = []
    for case in PRESSED[: 2 if quick else None]:
        motion = solved(reference(case), case["f"])
        given = np.array([case["exact"][str(n)] for n in range(10)])
        wave, ours = motion.coefficients(range(10))[0], np.zeros_like(given)
        ours[0, :, 0] = wave[:, 0]
        ours[1:, :, 0], ours[1:, :, 1] = wave[:, 1::2].T, -wave[:, 2::2].T
        what, size = f"{case['name']}, {case['f']:g} Hz", float(np.abs(given).max())
        loss, told = motion.friction_loss.sum(), case["dissipation"]
        rows += [
            compared(f"{what}: coefficients", ours, given, 1e-9, OTHER, unit="m", scale=size),
            compared(f"{what}: loss by friction", loss, told, 1e-11, OTHER, unit="J"),
        ]
    for kind, build in (("two_way", two_way), ("inclined", inclined), ("two_blades", two_blades)):
        for hertz, text in list(STATED[kind].items())[: 1 if quick else None]:
            wave = solved(build(), float(hertz)).coefficients(range(4))[0]
            sizes = np.column_stack([wave[:, 0], np.hypot(wave[:, 1::2], wave[:, 2::2])])
            first = sizes[:, 1] if kind == "two_blades" else [*sizes[0], *sizes[1:, 1]]
            expected = np.array(text.split(), float)
            what = f"{kind.replace('_', ' ')}, {float(hertz):g} Hz: sizes of harmonics"
            rows.append(compared(what, first, expected, 1e-9, OTHER, unit="m"))
    for name, (start, mean, size, _) in STATED["gap_stop"].items():
        wave = solved(gap_stop(), 21.5, [start, 0.0, 0.0]).coefficients((0, 1))[0][0]
        what = f"stop with three motions at 21.5 Hz, {name}: mean and first harmonic"
        found = wave[0], np.hypot(*wave[1:])
        rows.append(compared(what, found, (mean, size), 1e-9, OTHER, unit="m", scale=size))
    return rows


def balance(quick: bool) -> list[Comparison]:
    """What `verify` recomputes from a dataset, and the error that harmonics leave."""
    harmonics, turns = (1, 3, 5, 7, 9), 2 if quick else 6
    problem = fig03.problem(harmonics).with_parameters(normal_load=3.0)
    found = sh.frf(problem, (15, 23), progress=False)
    verified = sh.verify(found, exact=turns, progress=False)
    rows = []
    for name, figure in json.loads(verified.attrs["verification"])["figures"].items():
        if figure["bound"] is not None:
            what, source = f"blade, 3 N, 15 to 23 Hz: {name}", "recomputed by verify"
            rows.append(compared(what, figure["worst"], 0.0, figure["bound"], source, scale=1.0))
    points = EXACT["single_blade_points"][:: 5 if quick else 1]
    found, expected = [], []
    for point in points:
        given = fig03.problem((1, 3, 5, 7)).with_parameters(normal_load=point["Fn"])
        solution = sh.solve(given, point["freq_hz"], throw=True)
        found.append(float(solution.amplitude[0]))
        expected.append(point["x_max_abs"][0])
    what = "blade, harmonics up to 7: amplitude beside the exact motion"
    rows.append(compared(what, found, expected, 5e-4, MARCHED, unit="m"))
    return rows
