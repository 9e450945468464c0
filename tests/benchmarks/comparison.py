"""This library beside other programs: the blade and the tuned ring."""

from collections.abc import Callable

import symhbm as sh
from tests.benchmarks.clock import Timed, take_turns
from tests.benchmarks.problems import BLADE_BAND, RING_BAND, SHROUD_BAND, shrouded
from tests.benchmarks.problems import blade as blade_of
from tests.benchmarks.problems import ring as ring_of
from tests.benchmarks.programs import (
    CONVERGED,
    Found,
    MissingError,
    by_aft,
    by_pyharm,
    by_symhbm,
    converged,
)
from tests.benchmarks.table import Table, ratio, seconds

FEW, MANY = 256, 2080
"""Samples of a period: the usual number, and what an accuracy of about 1e-6 takes."""
SYMHBM, INTERPRETED = "symhbm", "symhbm, no compiler"
UNTOLD, KEPT = "symhbm, no stability", ["amplitude", "peak_frequency", "peak_amplitude"]
WHOLE, SAMPLED = "symhbm, full ring", f"symhbm, {FEW} samples"
LOOP, ACCURATE, PEER = f"loop, {FEW} samples", f"loop, {MANY} samples", f"pyHarm, {FEW} samples"
RATIOS = {
    f"{SYMHBM} / {LOOP}": (SYMHBM, LOOP),
    f"{INTERPRETED} / {LOOP}": (INTERPRETED, LOOP),
    f"{UNTOLD} / {LOOP}": (UNTOLD, LOOP),
    f"{SYMHBM} / {ACCURATE}": (SYMHBM, ACCURATE),
    f"{UNTOLD} / {ACCURATE}": (UNTOLD, ACCURATE),
    f"symhbm / loop, both {FEW} samples": (SAMPLED, LOOP),
    "pyHarm / symhbm": (PEER, SYMHBM),
}
EXPLANATION = (
    "CPU time of one warm curve, best of several (one from 1 s on), in brackets the accepted "
    "points and the relative errors of amplitude and frequency of the highest peak against "
    f"friction over {CONVERGED} samples, itself good to 1e-8 and 1e-5."
)

TOO_LONG = (
    f"This library over {FEW} samples is left out where it takes minutes: with 100 N it solves for "
    "each of hundreds of maxima that sampling makes."
)


def blade() -> list[Table]:
    """One blade, one harmonic, from far below to far above the load of full stick."""
    names = [SYMHBM, INTERPRETED, SAMPLED, LOOP, ACCURATE, PEER]
    caption = f"**One blade**, 10 to 30 Hz, one harmonic. {EXPLANATION}"
    table = _table(caption, "normal load", names)
    for load in (1, 3, 5, 18):
        problems = blade_of(load), blade_of(load, samples=FEW)
        _add(table, f"{load} N", names, *problems, BLADE_BAND)
    return [table]


def ring() -> list[Table]:
    """The tuned ring of 13 blades."""
    names = [SYMHBM, INTERPRETED, WHOLE, SAMPLED, LOOP, ACCURATE, PEER]
    caption = "**Ring of 13 blades**, engine order 3, 150 to 280 Hz, as above."
    table = _table(caption, "case", names)
    for load in (10, 100):
        for harmonics in ((1,), (1, 3), (1, 3, 5, 7, 9)):
            left_out = [] if (load, harmonics) == (10, (1,)) else [SAMPLED]
            if len(harmonics) > 2:
                left_out.append(PEER)
            chosen = [name for name in names if name not in left_out]
            problems = ring_of(harmonics, load), ring_of(harmonics, load, FEW)
            _add(table, f"{load} N, {harmonics}", chosen, *problems, RING_BAND)
    table.remarks.append(TOO_LONG)
    return [table]


def opening() -> list[Table]:
    """Rings of blades whose shrouds rub, open and close."""
    names = [SYMHBM, UNTOLD, LOOP, ACCURATE]
    caption = (
        "**Shrouds that rub and open**: rings of blades that move in two directions, harmonics 0 "
        "to 3, 10 to 35 Hz, as above; the normal loads vary with the motion. This library tells "
        "the stability of each point, unless `keep=` leaves it out."
    )
    table = _table(caption, "case", names)
    for n_blades, load in ((3, 4), (3, 12), (5, 4), (5, 10)):
        problem = shrouded(n_blades, load)
        _add(table, f"{n_blades} blades, {load} N", names, problem, problem, SHROUD_BAND)
    return [table]


def _table(caption: str, what: str, names: list[str]) -> Table:
    ratios = [ratio for ratio, (a, b) in RATIOS.items() if {a, b} <= {*names}]
    return Table(caption, [what, *names, *ratios])


def _add(
    table: Table,
    case: str,
    names: list[str],
    problem: sh.HarmonicBalance,
    sampled: sh.HarmonicBalance,
    band: tuple[float, float],
) -> None:
    """Measure the programs of these names on one problem."""
    exact = _or_missing(table, lambda: converged(problem, band))
    # Without the compiled loop, the peak of this library scales the peer.
    height = exact.amplitude if exact else by_symhbm(problem, band)()().amplitude
    makers: dict[str, Callable] = {
        SYMHBM: lambda: by_symhbm(problem, band),
        INTERPRETED: lambda: by_symhbm(problem, band, machine_code=False),
        UNTOLD: lambda: by_symhbm(problem, band, keep=KEPT),
        WHOLE: lambda: by_symhbm(problem.with_by_sector(False), band),
        SAMPLED: lambda: by_symhbm(sampled, band),
        LOOP: lambda: by_aft(problem, band, FEW),
        ACCURATE: lambda: by_aft(problem, band, MANY),
        PEER: lambda: by_pyharm(problem, band, FEW, height),
    }
    made = {name: _or_missing(table, makers[name]) for name in names}
    found = take_turns({name: program for name, program in made.items() if program})
    cells = [_cell(found.get(name), exact) for name in table.header[1:] if name not in RATIOS]
    pairs = [RATIOS[name] for name in table.header[1:] if name in RATIOS]
    ratios = [
        ratio(found[a].seconds / found[b].seconds) if a in found and b in found else "-"
        for a, b in pairs
    ]
    table.rows.append([case, *cells, *ratios])


def _or_missing(table: Table, make: Callable):
    try:
        return make()
    except MissingError as error:
        table.remarks.append(str(error))
        return None


def _cell(timed: Timed | None, exact: Found | None) -> str:
    if timed is None:
        return "-"
    found = timed.result
    if not found.amplitude > 0:
        return f"{seconds(timed.seconds)}, stopped within the band"
    errors = "-, -"
    if exact is not None:
        height = abs(found.amplitude / exact.amplitude - 1)
        place = abs(found.frequency / exact.frequency - 1)
        errors = f"{height:.0e}, {place:.0e}"
    return f"{seconds(timed.seconds)} ({found.points}; {errors})"
