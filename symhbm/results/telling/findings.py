"""Text on a result: request, completeness, peaks, contacts and errors."""

from collections.abc import Iterator

import numpy as np
import xarray as xr

from symhbm.continuation import Status
from symhbm.model.contacts import Behaviour
from symhbm.results import parts
from symhbm.results.reading import ALIKE, completeness, curve_status, largest, read, set_dimensions
from symhbm.results.telling.words import Rows, Words, count, counted

_WORST = {
    "residual_norm": "residual",
    "peak_residual_norm": "residual of peaks",
    "truncation_error": "truncation error",
    "peak_truncation_error": "  at the peaks",
    "sampling_error": "sampling error",
    "condensation_error": "condensation error",
    "periodicity": "periodicity",
}
"""Errors whose largest value is printed."""
ERRORS = {*(label.strip() for label in _WORST.values()), "verification"}
"""Labels of errors, which differ by round-off from one computation to the next."""


def findings(words: Words) -> Rows:
    """Labels and texts on a result: completeness, peaks, contacts and errors."""
    yield from _computed(words)
    yield from _completeness(words)
    yield from _stability(words.dataset)
    yield from _peaks(words)
    if best := words.worst("flutter_limit", f"{{:.{words.digits}g}}"):
        yield "largest flutter limit", ", ".join(best)
    yield from _contacts(words)
    yield from _trust(words)


def _computed(words: Words) -> Rows:
    dataset, along, short = words.dataset, words.along, words.short
    is_known = along in dataset.variables
    band = dataset[along].values if is_known else np.array(np.nan)
    if "followed" in dataset.attrs:
        kind = words.description.unforced
        subject = "frequency response" if along == "frequency" else f"response over {along}"
        subject = subject if kind is None else f"{kind} over its {along}"
        finite = band[np.isfinite(band)]
        ends = words.description.request.get("band") or _ends(band, finite)
        text = f"{subject} from {short(ends[0])} to {short(ends[1])} "
        if not is_known:
            text += "Hz, its peaks alone"
        elif not band.ndim:
            text = f"{subject}, {words.at(dataset[along])}"
        else:
            how = f"at {count(finite.size, 'value')}"
            how = "along the path" if "point" in dataset.dims else how
            how = "searched" if kind == "limit cycle" and along == "amplitude" else how
            text = f"{text}{dataset[along].attrs.get('units', '')}".rstrip() + f", {how}"
        if along != "frequency" and "frequency" in dataset.variables and kind is None:
            text += f", at {short(dataset['frequency'].values)} Hz"
    elif "frequency" not in dataset.variables:
        return  # at rest, or of numbers alone: the title says what it is
    else:
        values = dataset["frequency"].values
        at = f"{short(values)} Hz" if values.ndim == 0 else f"{values.size} frequencies"
        text = f"response at one frequency, {at}"
        if "angle" in dataset.dims:
            n_angles = dataset.sizes["angle"]
            text = f"periodic motion in time, without truncation, at {n_angles} angles, {at}"
    yield "computed", text


def _ends(band: np.ndarray, finite: np.ndarray) -> tuple[float, float]:
    """First and last value of the points of a band."""
    if not finite.size:
        return np.nan, np.nan
    several = band.ndim and band.shape[-1] > 1
    down = several and np.nanmean(np.diff(band.reshape(-1, band.shape[-1]), axis=-1)) < 0
    low, high = float(finite.min()), float(finite.max())
    return (high, low) if down else (low, high)


def _completeness(words: Words) -> Rows:
    dataset = words.dataset
    complete, waiting, failed = completeness(dataset)
    total = complete + waiting + failed.total()
    dims = set_dimensions(dataset)
    if dims:
        label = "branches" if dims == ("branch",) else "parameter sets"
        yield label, ", ".join(f"{dataset.sizes[dim]} along {dim}" for dim in dims)
    if (part := parts.part_of(dataset)) is not None:
        yield "part", f"{part.first} to {part.stop - 1} of the {part.size} along {part.dim}, from 0"
    if (n_parts := parts.n_merged(dataset)) > 0:
        yield "merged from", count(n_parts, "part")
    told = [f"{complete} of {total} complete"]
    told += [f"{failed.total()} not"] if failed else []
    told += [f"{waiting} of {total} not computed yet"] if waiting else []
    is_curve = "followed" in dataset.attrs
    yield "curves" if is_curve else "status", ", ".join(told)
    for text, number in failed.most_common():
        yield "", f"{number}: {text}"
    if "converged" in dataset.variables and is_curve:
        solved = sum(int(np.count_nonzero(block)) for _, block in read(dataset, "converged"))
        points = _n_points(words)
        several = " (each solution at a value counts)" if "solution" in dataset.dims else ""
        missing = points - solved
        text = f"{points}, {f'{missing} not' if missing else 'all'} converged"
        yield "points", text + several if points else "none"


def _n_points(words: Words) -> int:
    """Points of the sets that were computed, without the padding."""
    dataset = words.dataset
    if "point" in dataset.dims and words.along in dataset.variables:
        return int(np.count_nonzero(np.isfinite(dataset[words.along].values)))
    if "n_solutions" in dataset.variables:
        return int(np.maximum(dataset["n_solutions"].values, 0).sum())
    status = curve_status(dataset)
    assert status is not None
    sets = status.values
    begun = int(np.count_nonzero(sets != str(Status.NOT_STARTED)))
    return begun * dataset["converged"].size // max(1, sets.size)


def _stability(dataset: xr.Dataset) -> Rows:
    if "stability" in dataset.variables:
        counts = {"stable": 0, "unstable": 0, "unknown": 0}
        for block, converged in _solved(dataset, "stability"):
            for word, value in (("stable", 1), ("unstable", 0), ("unknown", -1)):
                counts[word] += int(np.count_nonzero((block == value) & converged))
        yield "stability", ", ".join(f"{n} {word}" for word, n in counts.items() if n) or "none"


def _peaks(words: Words) -> Rows:
    dataset, description = words.dataset, words.description
    top = None
    if "peak_amplitude" in dataset.variables:
        if "peak_kind" in dataset.variables:
            of_each = f" (of every {words.body})" * description.per_dof
            yield "peaks", counted(dataset["peak_kind"].values) + of_each
        amplitude = dataset["peak_amplitude"].copy()
        amplitude = amplitude.where(np.isfinite(amplitude))
        top = largest(dataset, "peak_amplitude", amplitude)
        if top is not None:
            value, index = top
            at = dataset.isel(index)
            error = float(at.get("peak_truncation_error", np.nan))
            told = [words.level(value, amplitude.attrs.get("units", "m"), error)]
            if f"peak_{words.along}" in at.variables:
                told.append(words.at(at[f"peak_{words.along}"]))
            peaks_of = description.problem.get("peaks_of")
            if "peak_dof" in at:
                number = int(at["peak_dof"])
                if isinstance(peaks_of, str):
                    told.append(f"{peaks_of} row {number}")
                else:  # a goal tells it by itself
                    told.append(words.place(number) if peaks_of is None else peaks_of["of"])
            told += [str(at["peak_kind"].values)] if "peak_kind" in at else []
            yield "highest peak", ", ".join([*told, *words.kept(), *words.set_words(index)])
    if "damping_ratio" in dataset.variables:
        if most := words.worst("damping_ratio", f"{{:.{words.digits}g}}"):
            yield "largest damping ratio", ", ".join(most)
    elif "amplitude" in dataset.variables:
        response = largest(dataset, "amplitude")
        # A response may be largest at an end of the band, which is no peak.
        other = not description.peaks_of_amplitude
        if response and (top is None or other or response[0] > top[0] * (1 + ALIKE)):
            level = words.level(response[0], dataset["amplitude"].attrs.get("units", "m"))
            told = [level, *words.location(response[1]), *words.kept()]
            yield "largest response", ", ".join(told)
    if "event_kind" in dataset.variables:
        yield "events", counted(dataset["event_kind"].values)


def _contacts(words: Words) -> Rows:
    dataset = words.dataset
    if "contact_state" in dataset.variables and dataset.sizes.get("contact"):
        labels = dataset["contact"].values
        did = np.zeros((4, len(labels)), dtype=bool)
        slipping = opening = points = 0
        for _, state in read(dataset, "contact_state", ("contact",)):
            state = state.reshape(-1, len(labels))
            did |= [(state == kind).any(axis=0) for kind in range(len(did))]
            slipping += int(np.count_nonzero((state == Behaviour.SLIPS).any(axis=1)))
            opening += int(np.count_nonzero((state == Behaviour.OPENS).any(axis=1)))
            points += int(np.count_nonzero((state >= 0).any(axis=1)))
        moves = did[Behaviour.SLIPS] | did[Behaviour.OPENS]
        kinds = {
            "slipping somewhere": did[Behaviour.SLIPS],
            "opening somewhere": did[Behaviour.OPENS],
            "always stuck": did[Behaviour.STICKS] & ~moves,
            "never touching": did[Behaviour.NEVER_TOUCHES] & ~moves & ~did[Behaviour.STICKS],
            "no known state": ~did.any(axis=0),
        }
        told = [
            f"{word}: {parts.ranges(labels[which])}" for word, which in kinds.items() if which.any()
        ]
        if points > 1:
            told.append(f"some contact slips at {slipping} of {points} points")
            told += [f"some contact opens at {opening}"] if opening else []
        yield "contacts", "; ".join(told)
    if "contact_model_valid" in dataset.variables:
        blocks = _solved(dataset, "contact_model_valid")
        broken = sum(int(np.count_nonzero(~valid & converged)) for valid, converged in blocks)
        if broken:
            yield "", f"the friction law does not hold for the motion at {broken} points"
    if dissipated := words.worst("dissipation", "at most {:.4g} J per cycle"):
        yield "dissipation", ", ".join(dissipated)


def _trust(words: Words) -> Rows:
    for name, label in _WORST.items():
        if maximum := words.worst(name, "at most {:.1e}"):
            yield label, ", ".join(maximum)
    report = words.description.verification
    if report is not None:
        verdict = "passed" if report["passed"] else "a bound is broken"
        n_peaks = report.get("n_peaks", 0)
        peaks = f", {count(n_peaks, 'peak')}" if n_peaks else ""
        yield "verification", f"{verdict}, {report['n_checked']} points checked{peaks}"


def _solved(dataset: xr.Dataset, name: str) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Blocks of a variable of points, and a mask of its converged values."""
    if "converged" not in dataset.variables:
        for _, values in read(dataset, name):
            yield values, values >= 0
        return
    converged = dataset["converged"].transpose(*dataset[name].dims).to_dataset(name="converged")
    masks = read(converged, "converged")
    for (_, values), (_, mask) in zip(read(dataset, name), masks, strict=True):
        yield values, mask
