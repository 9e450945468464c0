"""Comparisons with numbers that others publish, and with other programs of the same kind."""

import numpy as np

import symhbm as sh
from tests.benchmarks.programs import MissingError, by_pyharm, by_symhbm, optional
from tests.published import ONE_BLADE, blisk_sector, two_masses, van_der_pol
from tests.reference import STATED
from tests.validation.comparison import Comparison, Part, compared, computed, missing

NLVIB = "NLvib 1.3, example 05 (M. Krack, J. Gross), as printed"
LAXALDE = "printed for the disk of Laxalde and others (2007)"
CLOSED, OTHER = "closed form of one harmonic", "another program of our own"
PYHARM = "pyHarm (package pyHarm-os)"
SAMPLES = 4096


def parts(quick: bool) -> list[Part]:
    """Published modes and cycles, then programs of others."""
    return [
        computed(
            "Published frequencies, modes and cycles",
            "Motions without a force whose numbers others state.",
            published,
        ),
        computed(
            "Modes and cycles of one blade that rubs",
            "A blade on a Jenkins element; with one harmonic the values are closed forms.",
            lambda: one_blade(quick),
        ),
        computed(
            "Programs of others",
            "Only what is installed is run; `pip install -e '.[benchmark]'` installs pyHarm. "
            "NLvib needs MATLAB or Octave: its printed values stand above.",
            peers,
        ),
    ]


def published() -> list[Comparison]:
    """Two masses on dry friction, a disk, and the oscillator of van der Pol."""
    found = sh.nonlinear_modes(two_masses(21), band=(1e-2, 12.0), place=1, progress=False)
    told = STATED["two_masses_on_dry_friction"]
    frequency = 2 * np.pi * found.frequency.values / np.sqrt(640.0)
    modal, rows = np.log(found.modal_amplitude.values), []
    for name in ("at_small", "at_one", "at_large"):
        amplitude, expected = told[name]
        at = np.interp(np.log(amplitude), modal, frequency)
        what = f"two masses on dry friction: frequency at the modal amplitude {amplitude:g}"
        rows.append(compared(what, at, expected, 2e-6, NLVIB))
    what = "two masses on dry friction: highest frequency, at the fold"
    rows.append(compared(what, frequency.max(), told["highest"], 1.1e-4, NLVIB))
    free = 2 * np.pi * found.frequency.values[-1]
    what = "two masses on dry friction: frequency where the mass is free"
    rows.append(compared(what, free, told["free"], 5e-6, NLVIB, unit="rad/s"))
    for diameters, text in STATED["blisk"].items():
        expected = np.array(text.split(), float)
        at = sh.natural_modes(blisk_sector(), int(diameters)).frequency.values[: len(expected)]
        what = f"blisk of 24 sectors, {diameters} nodal diameters: natural frequencies"
        rows.append(compared(what, at, expected, 5e-10, LAXALDE, unit="Hz"))
    problem = sh.HarmonicBalance(van_der_pol(), harmonics=range(1, 26, 2))
    cycle = sh.limit_cycles(problem, amplitudes=(1.0, 3.0), progress=False)
    told, what = STATED["van_der_pol"], "oscillator of van der Pol"
    period, largest = 1 / cycle.frequency.values, cycle.largest_displacement.values.ravel()
    amore, hairer = "P. Amore, arXiv 2111.12198", "E. Hairer, test problems"
    return [
        *rows,
        compared(f"{what}: period", period, told["period"], 1e-9, amore, unit="s"),
        compared(f"{what}: amplitude", largest, told["amplitude"], 1e-8, hairer, unit="m"),
    ]


def one_blade(quick: bool) -> list[Comparison]:
    """Nonlinear modes and limit cycles of one blade, with one harmonic and with many."""
    rows = []
    for row in STATED["modes_of_one_blade"][: 2 if quick else None]:
        highest, amplitude, omega, damping_ratio = row.values()
        blade = sh.single_blade(damping=0.5, **ONE_BLADE)
        problem = sh.HarmonicBalance(blade, harmonics=range(1, highest + 1, 2))
        found = sh.nonlinear_modes(problem, at=[amplitude], progress=False)
        what = f"mode at {amplitude:g} m, harmonics to {highest}"
        source = CLOSED if highest == 1 else OTHER
        at, ratio = 2 * np.pi * found.frequency.values, found.damping_ratio.values
        rows += [
            compared(f"{what}: frequency", at, [[omega]], 1e-9, source, unit="rad/s"),
            compared(f"{what}: damping ratio", ratio, [[damping_ratio]], 6e-9, source),
        ]
    for row in STATED["limit_cycles_of_one_blade"][: 2 if quick else None]:
        damping, highest, amplitude, omega = row.values()
        blade = sh.single_blade(damping=damping, **ONE_BLADE)
        problem = sh.HarmonicBalance(blade, harmonics=range(1, highest + 1, 2))
        found = sh.limit_cycles(problem, progress=False)
        what = f"limit cycles, c = {damping:g} N s/m, harmonics to {highest}"
        source, sizes = CLOSED if highest == 1 else OTHER, found.amplitude.values
        rows.append(compared(f"{what}: amplitudes", sizes, amplitude, 4e-10, source, unit="m"))
        if omega is not None:
            at, what = 2 * np.pi * found.frequency.values, f"{what}: frequencies"
            rows.append(compared(what, at, omega, 6e-10, source, unit="rad/s"))
    return rows


def peers() -> list[Comparison]:
    """The peak of a blade, and the law of a contact, by pyHarm where it is installed."""
    from tests.benchmarks.problems import BLADE_BAND, blade

    problem, rows = blade(3), []
    ours = by_symhbm(problem, BLADE_BAND)()()
    try:
        theirs = by_pyharm(problem, BLADE_BAND, 256, ours.amplitude)()()
        source = f"{PYHARM}, 256 samples"
        rows += [
            compared("blade, 3 N: peak amplitude", ours.amplitude, theirs.amplitude, 1e-3, source),
            compared("blade, 3 N: peak frequency", ours.frequency, theirs.frequency, 5e-3, source),
        ]
    except MissingError as error:
        rows.append(missing("blade, 3 N: highest peak", PYHARM, str(error)))
    what = "law Penalty3D, a contact under preload that stays closed: force coefficients"
    try:
        rows.append(_law(what))
    except MissingError as error:
        rows.append(missing(what, PYHARM, str(error)))
    return rows


def _law(what: str) -> Comparison:
    """The law of pyHarm beside ours, where both are the same."""
    from symhbm.numerics import FourierBasis
    from tests.benchmarks.contacts import PEER_CASES, PEER_MOTION, VALUES, located

    peer, basis = optional("peer_penalty"), FourierBasis((0, 1, 2))
    springs = {name: value for name, value in VALUES.items() if name != "normal_load"}
    given = PEER_CASES["preload 2 N, stays closed"]
    ours = located(basis, PEER_MOTION[None], springs | dict(normal_load=given["preload"]))()[0]
    force, _ = peer.force_of(basis, springs | given, SAMPLES)(PEER_MOTION)
    size = float(np.abs(ours).max())
    return compared(what, ours, force, 1e-6, f"{PYHARM}, {SAMPLES} samples", unit="N", scale=size)
