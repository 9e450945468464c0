"""Damping and localisation: mistuned disks damped by friction, and as much by viscous dampers.

The source cites from the literature (Castanier et al. 1997, Wei and Pierre 1989) that localisation
decreases as damping increases, and that disks damped by dry friction are more sensitive to it.
Here the same 24 disks, the stiffness of each blade drawn within 2 %, are followed under engine
order 3, with friction dampers from free to stuck. Weak springs (100 N/m) join neighbouring blades;
friction dampers stand between each blade and the ground, as in Fig. 1 of the source, or between
neighbouring blades, as in its Fig. 5. Beside each load the same disks have none, but viscous
dampers with which the tuned disk has the same peak: at that damping both are compared.

Localisation is the inverse participation ratio at the largest response of a disk: 1/13 where all
blades move alike, 1 where only one moves. Amplification is the largest peak over the tuned one.

What friction takes is bounded by its limit. With loads below that of the lowest peak all contacts
slip: the more a blade moves, the less it is damped for its motion, and the more localised is the
response. With heavier loads a contact slips the more, the more it moves: blades that move most are
damped most. Mistuning also excites motions with fewer nodal diameters than the engine order has;
dampers between blades hardly damp these, and some disks localise with the best load. Stuck dampers
between blades are springs: they couple the blades, and a disk that is coupled localises less.

Contacts that never slip are the weak springs of the model. All responses have one harmonic.

Reference: E. Chatelet, D. Rade, G. Jacquet-Richardet, DINAME 2013 (hal-00941429), introduction.
"""

from concurrent.futures import Executor, ProcessPoolExecutor
from importlib.metadata import version
from itertools import product
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from tqdm import tqdm

import symhbm as sh
from studies import sampling
from studies.claim import Claim, Finding
from studies.closed_form import EXACT_DIGITS
from studies.damped_disks import (
    CONTACT_STIFFNESS,
    COUPLING,
    DAMPING,
    ENGINE_ORDER,
    FRICTION_COEFFICIENT,
    N_BLADES,
    PLACES,
    by_linear_algebra,
    equal_damping,
    friction_disk,
    tuned_blade,
    viscous_disk,
)
from studies.landmark import Landmark, Source
from studies.run import run

NAME = "damping_and_localisation"
NORMAL_LOADS = (0.1, 0.5, 1.0, 1.3, 1.6, 2.0, 3.0, 10.0, 100.0, 300.0, 1000.0)  # N
BANDS = {"to the ground": (13.0, 24.0), "between blades": (13.0, 36.0)}  # Hz
VISCOUS_BAND = (12.0, 18.0)  # Hz
HALF_WIDTH = 0.02
"""Relative half-width of the uniform draws of each blade's stiffness."""
N_SAMPLES = 24
SEED = 2013
KINDS = ("friction", "viscous")
SHARE, ERRORS = 0.01, 3.0
"""Relative difference of means, and standard errors of it, from which they are said to differ."""
OTHER_FAMILY = 0.05
"""Relative difference of frequencies that mistuning by 2 % does not explain."""
CITED = "introduction, cited from Castanier et al. and Wei and Pierre"
SURELY_LESS = (1.0, 100.0, 300.0)
"""Loads [N] at which contacts slip, and with which mistuned disks amplify less."""
LOOKS = {"friction": ("o", 1.07, "black"), "viscous": ("D", 0.93, "#d55e00")}
"""Marker, shift and colour of a kind of damping: both are beside each other at one load."""


def compute(progress: bool = True) -> xr.Dataset:
    """Localisation and amplification of all disks, by place, load and kind of damping."""
    draws = sh.mistuning.uniform(viscous_disk(DAMPING), N_SAMPLES, seed=SEED, stiffness=HALF_WIDTH)
    parts = []
    with ProcessPoolExecutor() as pool:
        for place, load in tqdm(list(product(PLACES, NORMAL_LOADS)), NAME, disable=not progress):
            friction = of_disks(friction_disk(place, load), BANDS[place], draws, pool)
            damping = equal_damping(tuned_blade(place, load), float(friction.tuned_peak))
            viscous = of_disks(viscous_disk(damping), VISCOUS_BAND, draws, pool)
            both = xr.concat([friction, viscous], "kind").assign_coords(kind=list(KINDS))
            parts.append(both.assign(damping=damping))
    rows = [xr.concat(parts[i :: len(NORMAL_LOADS)], "place") for i in range(len(NORMAL_LOADS))]
    dataset = xr.concat(rows, "normal_load").transpose("place", "normal_load", "kind", "sample")
    return _described(dataset, draws)


def of_disks(
    problem: sh.HarmonicBalance, band: tuple[float, float], draws: xr.Dataset, pool: Executor
) -> xr.Dataset:
    """Localisation, amplification and frequency of the peak of each disk; the tuned peak."""
    tuned = sh.frf(problem, band, throw=True, progress=False)
    disks = sh.frf(problem, band, over=draws, executor=pool, throw=True, progress=False)
    highest = disks.peak_amplitude.fillna(-np.inf).argmax("peak")
    statistics = sh.statistics
    values = {
        "localisation": statistics.localisation(disks).localisation_at_peak,
        "amplification": statistics.amplification(disks, tuned).largest_amplification_of_peaks,
        "peak_frequency": disks.peak_frequency.isel(peak=highest),
    }
    found = {name: ("sample", value.values) for name, value in values.items()}
    top = tuned.isel(peak=int(tuned.peak_amplitude.argmax("peak")))
    return xr.Dataset(found).assign(
        tuned_peak=top.peak_amplitude.item(), tuned_frequency=top.peak_frequency.item()
    )


def _described(dataset: xr.Dataset, draws: xr.Dataset) -> xr.Dataset:
    """The dataset with coordinates, units and meanings, and what it was computed with."""
    about = {
        "localisation": ("1", "inverse participation ratio of the amplitudes at the peak"),
        "amplification": ("1", "largest peak over that of the tuned disk"),
        "peak_frequency": ("Hz", "frequency of the largest peak"),
        "tuned_peak": ("m", "largest peak of the tuned disk"),
        "tuned_frequency": ("Hz", "frequency of the largest peak of the tuned disk"),
        "damping": ("N s m-1", "viscous damping with the same tuned peak as friction"),
        "normal_load": ("N", "normal load of the friction dampers"),
        "place": ("1", "place of the friction dampers"),
        "kind": ("1", "kind of damping"),
    }
    dataset = dataset.assign_coords(place=list(PLACES), normal_load=list(NORMAL_LOADS))
    for name, (units, long_name) in about.items():
        dataset[name].attrs = {"units": units, "long_name": long_name}
    scalars = {
        "mass": (1.0, "kg", "blade mass"),
        "contact_stiffness": (CONTACT_STIFFNESS, "N m-1", "stiffness of the friction dampers"),
        "friction_coefficient": (FRICTION_COEFFICIENT, "1", "coefficient of friction"),
        "coupling": (COUPLING, "N m-1", "stiffness of the springs between neighbouring blades"),
        "least_damping": (DAMPING, "N s m-1", "viscous damping beside friction"),
    }
    variables: dict[str, Any] = {
        name: ((), value, {"units": units, "long_name": long_name})
        for name, (value, units, long_name) in scalars.items()
    }
    stiffness = draws["stiffness"]
    variables["stiffness"] = (stiffness.dims, stiffness.values, stiffness.attrs)
    return dataset.assign(variables).assign_attrs(
        title="Localisation of mistuned disks with friction and with viscous damping",
        references="E. Chatelet, D. Rade, G. Jacquet-Richardet, DINAME 2013, hal-00941429",
        seed=SEED,
        engine_order=ENGINE_ORDER,
        symhbm_schema=1,
        symhbm_version=version("symhbm"),
    )


def draw(dataset: xr.Dataset) -> Figure:
    """Draw localisation and amplification over viscous damping, and over both kinds of load."""
    rows = {
        "localisation": "localisation at the peak",
        "amplification": "largest peak over the tuned one",
    }
    with sh.plot.panels(
        len(rows), 1 + dataset.sizes["place"], size=(11.0, 6.6), sharex="col", sharey="row"
    ) as (figure, axes):
        viscous = _over_damping(dataset)
        for line, (name, label) in zip(axes, rows.items(), strict=True):
            _draw_bars(line[0], viscous.damping, viscous[name], "viscous")
            for ax, place in zip(line[1:], dataset.place.values, strict=True):
                one = dataset[name].sel(place=place)
                for kind in reversed(KINDS):
                    _draw_bars(ax, dataset.normal_load, one.sel(kind=kind), kind)
            line[0].set_ylabel(label)
            for ax in line:
                ax.set_xscale("log")
        for ax, place in zip(axes[0, 1:], dataset.place.values, strict=True):
            ax.set_title(f"friction dampers {place}")
        axes[0, 0].set_title("viscous dampers alone")
        axes[-1, 0].set_xlabel("viscous damping $c$ [N s/m]")
        for ax in axes[-1, 1:]:
            ax.set_xlabel("normal load $F_n$ [N]")
        axes[0, -1].legend(loc="upper right")
        figure.suptitle(
            f"{dataset.sizes['sample']} disks with blades within {100 * HALF_WIDTH:g} %, "
            f"EO {ENGINE_ORDER}, one harmonic\n"
            f"dots: mean, thick: its {sampling.WORDS}, thin: least to largest"
        )
    return figure


def _draw_bars(ax: Axes, x: xr.DataArray, values: xr.DataArray, kind: str) -> None:
    """Draw the disks at the values that were computed, and nothing between these."""
    label = kind if kind == "friction" else "viscous, same tuned peak"
    marker, aside, color = LOOKS[kind]
    rows = values.transpose(..., "sample").values
    mean, half = rows.mean(axis=-1), sampling.of_mean(rows)
    at = aside * x.values
    ax.vlines(at, rows.min(axis=-1), rows.max(axis=-1), color=color, linewidth=0.8)
    ax.vlines(at, mean - half, mean + half, color=color, linewidth=3.5, alpha=0.55)
    look: Any = dict(color=color, markersize=4.5, markeredgecolor="black", markeredgewidth=0.6)
    ax.plot(at, mean, marker, label=label, **look)


def _over_damping(dataset: xr.Dataset) -> xr.Dataset:
    """All disks with viscous damping alone, in the order of the damping."""
    viscous = dataset[["localisation", "amplification", "damping"]].sel(kind="viscous")
    flat = viscous.stack(case=("place", "normal_load"), create_index=False)
    return flat.sortby("damping")


def landmarks(dataset: xr.Dataset) -> list[Landmark]:
    """Closed forms of the tuned peaks, linear algebra, and bounds of any linear disk."""
    closed = xr.zeros_like(dataset.tuned_peak)
    for place, load in product(dataset.place.values.tolist(), dataset.normal_load.values.tolist()):
        closed.loc[dict(place=place, normal_load=load)] = tuned_blade(place, load).peak()[0]
    viscous = dataset.sel(kind="viscous")
    solved = by_linear_algebra(dataset)
    rows = {
        "tuned peaks with friction, largest difference from the closed form": (
            np.abs(dataset.tuned_peak / closed - 1).sel(kind="friction").max()
        ),
        "tuned peaks with viscous dampers, largest difference from those with friction": (
            np.abs(dataset.tuned_peak.sel(kind="viscous") / dataset.tuned_peak - 1).max()
        ),
    }
    for name in ("localisation", "amplification"):
        rows[f"{name} with viscous dampers, largest difference from linear algebra"] = np.abs(
            viscous[name] / solved[name] - 1
        ).max()
    bound = (1 + np.sqrt(N_BLADES)) / 2
    slack = 1 + EXACT_DIGITS
    outside = (dataset.localisation * N_BLADES * slack < 1) | (dataset.localisation > slack)
    counts = {
        "localisations outside of 1/13 to 1": outside.sum(),
        "viscous disks that amplify more than (1 + sqrt(13)) / 2 times": (
            viscous.amplification > bound
        ).sum(),
    }
    return [
        *(
            Landmark(name, float(value), 0.0, "", Source.CLOSED_FORM, EXACT_DIGITS)
            for name, value in rows.items()
        ),
        *(
            Landmark(name, int(value), 0.0, "", Source.CLOSED_FORM, 0.0)
            for name, value in counts.items()
        ),
    ]


def more_than_viscous(values: xr.DataArray) -> xr.DataArray:
    """1 where friction has the larger mean over the same disks, -1 where the smaller, 0 unsure."""
    friction, viscous = (values.sel(kind=kind, drop=True) for kind in KINDS)
    each = friction - viscous
    mean = each.mean("sample")
    sure = np.abs(mean) > ERRORS * each.std("sample", ddof=1) / np.sqrt(each.sizes["sample"])
    visible = np.abs(mean) > SHARE * viscous.mean("sample")
    return np.sign(mean) * (sure & visible)


def _loads(sign: xr.DataArray, wanted: int) -> str:
    """The loads [N] at which a sign is that wanted, in words."""
    loads = sign.normal_load.values[sign.values == wanted]
    return ", ".join(f"{load:g}" for load in loads) + " N" if len(loads) else "no load"


def claims(dataset: xr.Dataset) -> list[Claim]:
    """What the source cites from the literature."""
    viscous = _over_damping(dataset)
    mean = viscous.localisation.mean("sample").values
    damping = viscous.damping.values
    sign = more_than_viscous(dataset.localisation)
    means = dataset.localisation.mean("sample")
    ratio = means.sel(kind="friction", drop=True) / means.sel(kind="viscous", drop=True)
    told = []
    for place in PLACES:
        own, size = sign.sel(place=place), ratio.sel(place=place)
        told.append(
            f"dampers {place}: more localised than with viscous dampers with {_loads(own, 1)} "
            f"(by up to {100 * (float(size.max()) - 1):.0f} %), less with {_loads(own, -1)} "
            f"(by up to {100 * (1 - float(size.min())):.0f} %)"
        )
    return [
        Claim(
            "The degree of localisation decreases as damping increases",
            CITED,
            f"mean of {dataset.sizes['sample']} disks from {mean[0]:.3f} with c = {damping[0]:.2f} "
            f"to {mean[-1]:.3f} with {damping[-1]:.0f} N s/m, viscous; blades that move alike have "
            f"{1 / N_BLADES:.3f}",
            bool(np.all(np.diff(mean) < 1e-3 * mean[:-1]) and mean[-1] < 0.6 * mean[0]),
            True,
        ),
        Claim(
            "Dry friction damped systems are more sensitive to localised vibrations",
            CITED,
            "; ".join(told),
            bool((sign >= 0).all() and (sign > 0).any()),
            False,
        ),
    ]


def findings(dataset: xr.Dataset) -> list[Finding]:
    """Amplification beside localisation, and why disks localise with the best load."""
    sign = more_than_viscous(dataset.amplification)
    means = dataset.amplification.mean("sample")
    best = dataset.tuned_peak.sel(kind="friction").idxmin("normal_load")
    less, more = [], []
    for place in PLACES:
        mean = means.sel(place=place)
        most = (mean.sel(kind="friction") / mean.sel(kind="viscous")).idxmax("normal_load")
        for load, rows in (*((load, less) for load in SURELY_LESS), (float(most), more)):
            friction, viscous = (float(mean.sel(normal_load=load, kind=kind)) for kind in KINDS)
            rows.append(f"{place} {friction:.2f} and {viscous:.2f} ({load:g} N)")
    frequency = dataset.sel(kind="friction")
    elsewhere = np.abs(frequency.peak_frequency / frequency.tuned_frequency - 1) > OTHER_FAMILY
    counts = {
        place: int(elsewhere.sel(place=place, normal_load=best.sel(place=place)).sum())
        for place in PLACES
    }
    return [
        Finding(
            "Well below the best load and well above it, friction lets mistuned disks amplify less "
            "than viscous damping of the same tuned peak",
            f"mean with friction and with viscous dampers: {', '.join(less)}",
            bool((sign.sel(normal_load=list(SURELY_LESS)) == -1).all()),
        ),
        Finding(
            "A little below the best load it lets them amplify more",
            f"mean with friction and with viscous dampers: {', '.join(more)}",
            bool((sign == 1).any("normal_load").all()),
        ),
        Finding(
            "With the best load between blades mistuned disks may answer most in another family of "
            "nodal diameters",
            f"{counts['between blades']} of {dataset.sizes['sample']} disks with "
            f"{float(best.sel(place='between blades')):g} N; to the ground "
            f"{counts['to the ground']} with {float(best.sel(place='to the ground')):g} N",
            counts["between blades"] > 0 == counts["to the ground"],
        ),
    ]


if __name__ == "__main__":
    run(NAME, compute, draw)
