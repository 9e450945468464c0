"""Responses synthesised from one nonlinear mode beside the true ones, at five forces each.

``python -m studies.synthesis_error`` prints the table of the guide to nonlinear modes: a blade and
a ring, for which one mode stands; two blades whose frequencies are equal while the contact sticks;
two blades of which one is strongly damped, without and with a mode whose frequency it passes as
the contact slips; and a blade that folds over as it meets a stop.
"""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
import xarray as xr

import symhbm as sh

FORCES = (0.3, 0.8, 1.2, 1.6, 2.2)
"""Of structures whose contacts slip at 1.5 N: from little slip to gross slip [N]."""
_LARGE = (1.0, 2.0, 4.0, 8.0, 16.0)
BAND = (5.0, 60.0)
"""[Hz]"""
_EXACT = 1e-8
"""Error that is shown as none."""
HEADER = (
    "| structure | force | true peak | amplitude of the peak off | frequency off | "
    "response there off | flanks off |"
)


class Case(NamedTuple):
    """A structure, its force of an amplitude [N], harmonics, forces [N] and mode."""

    name: str
    model: sh.Model
    force: Callable[[float], sh.forces.PointForce | sh.forces.EngineOrder]
    harmonics: tuple[int, ...]
    forces: tuple[float, ...] = FORCES
    nodal_diameter: int | None = None
    mode: int = 0


class Row(NamedTuple):
    """A ``force`` [N], the true peak [m], [Hz], and relative errors; NaN where none is told."""

    name: str
    force: float
    amplitude: float
    frequency: float
    amplitude_error: float
    frequency_error: float
    response_error: float
    flank_error: float


def _point(amplitude: float) -> sh.forces.PointForce:
    return sh.forces.PointForce(amplitude=amplitude)


def _order(amplitude: float) -> sh.forces.EngineOrder:
    return sh.forces.EngineOrder(3, amplitude=amplitude)


def _two(other: float, coupling: float, damping: tuple[float, float]) -> sh.Model:
    """A blade that rubs, coupled to another one of a stiffness [N/m]."""
    rubs = sh.Contacts(
        sh.laws.Coulomb(), [(0,)], contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3
    )
    stiffness = [[1e4 + coupling, -coupling], [-coupling, other + coupling]]
    return sh.Model(np.eye(2), np.diag(damping), stiffness, contacts={"rubs": rubs})


def cases() -> list[Case]:
    """The structures of the table."""
    values = dict(
        mass=1, stiffness=1e4, damping=0.5,
        contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    )  # fmt: skip
    stop = sh.Gap(normal=(0,), normal_stiffness=2e4, gap=1e-3)
    on_stop = sh.Model([[1.0]], [[2.0]], [[1e4]], contacts={"stop": stop})
    near, damped = _two(2.02e4, 500.0, (1.0, 1.0)), _two(4e4, 3e3, (60.0, 5.0))
    crossing, odd = _two(1.6e4, 3e3, (60.0, 5.0)), (1, 3, 5)
    return [
        Case("one blade", sh.single_blade(**values), _point, (1, 3, 5, 7, 9)),
        Case("ring of 13, engine order 3", sh.bladed_disk(13, **values), _order, odd, FORCES, 3),
        Case("two near modes", near, _point, odd),
        Case("strong damping", damped, _point, odd, _LARGE),
        Case("strong damping, near mode", crossing, _point, odd, _LARGE, mode=1),
        Case("a stop, folds", on_stop, _point, tuple(range(8)), (0.1, 0.2, 0.4, 0.8, 1.6)),
    ]


def compute(case: Case) -> Iterator[Row]:
    """The rows of a case. Amplitudes are those of the first harmonic at the first blade."""
    problem = sh.HarmonicBalance(case.model, harmonics=case.harmonics)
    modes = sh.nonlinear_modes(
        problem,
        mode=case.mode,
        band=(1e-6, 1e-1),
        nodal_diameter=case.nodal_diameter,
        progress=False,
    )
    for force in case.forces:
        near = sh.datasets.synthesised_response(modes, case.force(force))
        driven = sh.HarmonicBalance(case.model, case.force(force), case.harmonics)
        amplitude, frequency = _peak(sh.frf(driven, BAND, progress=False))
        flanks = near.synthesis_error.values[:, near.amplitude.values >= amplitude / 2]
        found = near.peak_amplitude.item(), near.peak_frequency.item()
        yield Row(
            case.name,
            force,
            amplitude,
            frequency,
            found[0] / amplitude - 1,
            found[1] / frequency - 1,
            near.peak_synthesis_error.item(),
            float(np.nanmax(flanks, initial=-1)) if np.isfinite(flanks).any() else np.nan,
        )


def _peak(response: xr.Dataset) -> tuple[float, float]:
    """First harmonic [m] of the first blade at its highest peak, and the frequency [Hz]."""
    first = response.peak_coefficient.sel(harmonic=1).isel(dof=0)
    amplitudes = np.hypot(first.sel(component="cos"), first.sel(component="sin")).values
    highest = int(np.nanargmax(amplitudes))
    return float(amplitudes[highest]), response.peak_frequency[highest].item()


def lines(rows: list[Row]) -> list[str]:
    """Rows as lines of a Markdown table."""
    return [
        f"| {row.name} | {row.force:g} N | "
        f"{1e3 * row.amplitude:.4f} mm, {row.frequency:.3f} Hz | "
        + " | ".join(map(_percent, row[4:]))
        + " |"
        for row in rows
    ]


def _percent(error: float) -> str:
    if np.isnan(error):
        return "none near"
    percent = 100 * error
    if abs(error) < _EXACT:
        return "0"
    return f"{percent:.0f} %" if abs(percent) >= 10 else f"{percent:.2g} %"


def table() -> str:
    """The whole table as Markdown."""
    rows = [row for case in cases() for row in compute(case)]
    return "\n".join([HEADER, "|---" * (HEADER.count("|") - 1) + "|", *lines(rows)])


if __name__ == "__main__":
    print(table())
