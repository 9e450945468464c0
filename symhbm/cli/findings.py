"""Text on a result: request, completeness, peaks, contacts and errors."""

from collections import Counter
from collections.abc import Iterator
from typing import Any

import numpy as np
import xarray as xr

from symhbm.continuation import Status
from symhbm.model.contacts import Behaviour
from symhbm.results import LARGEST_OF, Description, parts
from symhbm.results.reading import ALIKE, completeness, largest, moving, read, set_dimensions

Lines = Iterator[tuple[str, str]]


def findings(dataset: xr.Dataset) -> Lines:
    """Labels and texts on a result: completeness, peaks, contacts and errors."""
    yield from _computed(dataset)
    yield from _peaks(dataset)
    yield from _best(dataset)
    yield from _contacts(dataset)
    yield from _trust(dataset)


def short(value: Any) -> str:
    """A label as text, numbers to six digits."""
    value = np.asarray(value).item()
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def count(number: int, noun: str) -> str:
    """A number of things."""
    plural = noun.replace("degree", "degrees") if noun.startswith("degree") else f"{noun}s"
    return f"{number} {noun if number == 1 else plural}"


def _computed(dataset: xr.Dataset) -> Lines:
    along = moving(dataset)
    band = dataset[along].values if along in dataset.variables else np.array(np.nan)
    unit = dataset[along].attrs.get("units", "") if along in dataset.variables else ""
    on_path = "point" in dataset.dims and band.ndim > 0
    finite = band[np.isfinite(band)]
    if "followed" in dataset.attrs:
        kind = Description(dataset).unforced
        subject = "frequency response" if along == "frequency" else f"response over {along}"
        subject = subject if kind is None else f"{kind} over its {along}"
        ends = Description(dataset).request.get("band") or _ends(band, finite)
        text = f"{subject} from {short(ends[0])} to {short(ends[1])} {unit}".rstrip()
        alone = kind == "limit cycle" and along == "amplitude"
        text += (
            ", searched"
            if alone
            else ", along the path"
            if on_path
            else f", at {count(finite.size, 'value')}"
        )
        if along not in dataset.variables:
            text = f"{subject} from {short(ends[0])} to {short(ends[1])} Hz, its peaks alone"
        elif not band.ndim:
            text = f"{subject}, {_at(dataset[along])}"
        if along != "frequency" and "frequency" in dataset.variables and kind is None:
            text += f", at {short(dataset['frequency'].values)} Hz"
    elif "angle" in dataset.dims:
        text = "periodic motion in time, without truncation"
        text += f", at {dataset.sizes['angle']} angles, {_at_frequency(dataset)}"
    else:
        text = f"response at one frequency, {_at_frequency(dataset)}"
    yield "computed", text
    yield from _completeness(dataset, on_path)
    if "stability" in dataset.variables:
        counts = {"stable": 0, "unstable": 0, "unknown": 0}
        for block, converged in _solved(dataset, "stability"):
            for word, value in (("stable", 1), ("unstable", 0), ("unknown", -1)):
                counts[word] += int(np.count_nonzero((block == value) & converged))
        yield "stability", ", ".join(f"{n} {word}" for word, n in counts.items() if n) or "none"


def _ends(band: np.ndarray, finite: np.ndarray) -> tuple[float, float]:
    """First and last value of the points of a band."""
    if not finite.size:
        return np.nan, np.nan
    several = band.ndim and band.shape[-1] > 1
    down = several and np.nanmean(np.diff(band.reshape(-1, band.shape[-1]), axis=-1)) < 0
    low, high = float(finite.min()), float(finite.max())
    return (high, low) if down else (low, high)


def _at_frequency(dataset: xr.Dataset) -> str:
    values = dataset["frequency"].values
    return f"{short(values)} Hz" if values.ndim == 0 else f"{values.size} frequencies"


def _completeness(dataset: xr.Dataset, on_path: bool) -> Lines:
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
    words = [f"{complete} of {total} complete"]
    words += [f"{failed.total()} not"] if failed else []
    words += [f"{waiting} of {total} not computed yet"] if waiting else []
    yield "curves" if "followed" in dataset.attrs else "status", ", ".join(words)
    for text, number in failed.most_common():
        yield "", f"{number}: {text}"
    if "converged" in dataset.variables and "followed" in dataset.attrs:
        solved = sum(int(np.count_nonzero(block)) for _, block in read(dataset, "converged"))
        points = _n_points(dataset, on_path)
        several = " (each solution at a value counts)" if "solution" in dataset.dims else ""
        missing = points - solved
        text = f"{points}, all converged" if not missing else f"{points}, {missing} not converged"
        yield "points", text + several if points else "none"


def _n_points(dataset: xr.Dataset, on_path: bool) -> int:
    """Points of the sets that were computed, without the padding."""
    if on_path:
        values = dataset[moving(dataset)].values
        return int(np.count_nonzero(np.isfinite(values)))
    if "n_solutions" in dataset.variables:
        return int(np.maximum(dataset["n_solutions"].values, 0).sum())
    sets = dataset["status"].values
    begun = int(np.count_nonzero(sets != str(Status.NOT_STARTED)))
    return begun * dataset["converged"].size // max(1, sets.size)


def _peaks(dataset: xr.Dataset) -> Lines:
    along = moving(dataset)
    top = None
    if "peak_amplitude" in dataset.variables:
        if "peak_kind" in dataset.variables:
            kinds = Counter(map(str, dataset["peak_kind"].values.ravel().tolist()))
            kinds.pop("", None)
            per_dof = Description(dataset).per_dof
            yield "peaks", _counted(kinds) + f" (of every {_body(dataset)})" * per_dof
        amplitude = dataset["peak_amplitude"].copy()
        amplitude = amplitude.where(np.isfinite(amplitude))
        top = largest(dataset, "peak_amplitude", amplitude)
        if top is not None:
            value, index = top
            at = dataset.isel(index)
            words = [_decibel(value, amplitude.attrs.get("units", "m"))]
            if f"peak_{along}" in at.variables:
                words.append(_at(at[f"peak_{along}"]))
            peaks_of = Description(dataset).problem.get("peaks_of")
            if "peak_dof" in at:
                number = int(at["peak_dof"])
                words.append(f"{peaks_of} row {number}" if peaks_of else place(dataset, number))
            words += [str(at["peak_kind"].values)] if "peak_kind" in at else []
            words += [*_kept(dataset), *_set_words(dataset, index)]
            yield "highest peak", ", ".join(words)
    if "damping_ratio" in dataset.variables:
        most = largest(dataset, "damping_ratio")
        if most is not None:
            where = _location(dataset, "damping_ratio", most[1])
            yield "largest damping ratio", ", ".join([short(most[0]), *where])
    elif "amplitude" in dataset.variables:
        response = largest(dataset, "amplitude")
        # A response may be largest at an end of the band, which is no peak.
        other = not Description(dataset).peaks_of_amplitude
        beyond = top is None or other or response is None or response[0] > top[0] * (1 + ALIKE)
        if response is not None and beyond:
            where = _location(dataset, "amplitude", response[1])
            units = dataset["amplitude"].attrs.get("units", "m")
            words = [_decibel(response[0], units), *where, *_kept(dataset)]
            yield "largest response", ", ".join(words)
    if "event_kind" in dataset.variables:
        events = Counter(map(str, dataset["event_kind"].values.ravel().tolist()))
        events.pop("", None)
        yield "events", _counted(events)


def _best(dataset: xr.Dataset) -> Lines:
    """The largest flutter limit."""
    if "flutter_limit" in dataset.variables:
        most = largest(dataset, "flutter_limit")
        if most is not None:
            words = [short(most[0]), *_location(dataset, "flutter_limit", most[1])]
            yield "largest flutter limit", ", ".join(words)


def _contacts(dataset: xr.Dataset) -> Lines:
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
        }
        kinds["always stuck"] = did[Behaviour.STICKS] & ~moves
        kinds["never touching"] = did[Behaviour.NEVER_TOUCHES] & ~moves & ~did[Behaviour.STICKS]
        kinds["no known state"] = ~did.any(axis=0)
        words = [f"{w}: {_ranges(labels[k])}" for w, k in kinds.items() if k.any()]
        if points > 1:
            words.append(f"some contact slips at {slipping} of {points} points")
            words += [f"some contact opens at {opening}"] if opening else []
        yield "contacts", "; ".join(words)
    if "contact_model_valid" in dataset.variables:
        blocks = _solved(dataset, "contact_model_valid")
        broken = sum(int(np.count_nonzero(~valid & converged)) for valid, converged in blocks)
        if broken:
            yield "", f"the friction law does not hold for the motion at {broken} points"
    if "dissipation" in dataset.variables:
        dissipated = largest(dataset, "dissipation")
        if dissipated is not None:
            words = [f"at most {dissipated[0]:.4g} J per cycle"]
            yield "dissipation", ", ".join(words + _location(dataset, "dissipation", dissipated[1]))


def _trust(dataset: xr.Dataset) -> Lines:
    worst = {
        "residual_norm": "residual",
        "peak_residual_norm": "residual of peaks",
        "truncation_error": "truncation error",
        "peak_truncation_error": "  at the peaks",
        "sampling_error": "sampling error",
        "periodicity": "periodicity",
    }
    for name, label in worst.items():
        maximum = largest(dataset, name) if name in dataset.variables else None
        if maximum is not None:
            words = [f"at most {maximum[0]:.1e}", *_location(dataset, name, maximum[1])]
            yield label, ", ".join(words)
    report = Description(dataset).verification
    if report is not None:
        verdict = "passed" if report["passed"] else "a bound is broken"
        text = f"{verdict}, {report['n_checked']} points checked"
        n_peaks = report.get("n_peaks", 0)
        yield "verification", f"{text}, {count(n_peaks, 'peak')}" if n_peaks else text


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


def _location(dataset: xr.Dataset, name: str, index: dict[str, int]) -> list[str]:
    """Location of an entry of a variable: frequency, blade or contact, parameters."""
    along = moving(dataset)
    words = []
    for label in (f"peak_{along}" if "peak" in index else along, "angle"):
        if label not in dataset.variables or not dataset[label].ndim:
            continue
        if set(dataset[label].dims) <= set(index):
            words.append(_at(dataset[label].isel({d: index[str(d)] for d in dataset[label].dims})))
    if "dof" in index:
        words.append(place(dataset, int(dataset["dof"].values[index["dof"]])))
    if "contact" in index:
        words.append(f"contact {dataset['contact'].values[index['contact']]}")
    return words + _set_words(dataset, index)


def _at(value: xr.DataArray) -> str:
    return f"at {short(value.values)} {value.attrs.get('units', '')}".rstrip()


def _set_words(dataset: xr.Dataset, index: dict[str, int]) -> list[str]:
    """The parameter set of an entry."""
    set_index = {dim: index[dim] for dim in set_dimensions(dataset) if dim in index}
    words = []
    for dim, position in set_index.items():
        label = dataset[dim].values[position] if dim in dataset.variables else position
        words.append(f"{dim}={short(label)}")
    for name in Description(dataset).swept:
        if name in set_index or name not in dataset.variables or not dataset[name].ndim:
            continue
        if set(dataset[name].dims) <= set(set_index):
            value = dataset[name].isel({d: set_index[str(d)] for d in dataset[name].dims}).values
            words.append(f"{name}={short(value)}")
    return words


def place(dataset: xr.Dataset, number: int) -> str:
    """A degree of freedom by its name, node and direction, or number."""
    numbers = np.atleast_1d(dataset["dof"].values).tolist() if "dof" in dataset.coords else []
    if {"node", "direction"} <= {*dataset.coords} and number in numbers:
        at = numbers.index(number)
        nodes, ways = (np.atleast_1d(dataset[name].values) for name in ("node", "direction"))
        names = np.atleast_1d(dataset["label"].values) if "label" in dataset.coords else nodes
        one = names[at] != "" and np.unique(nodes[names == names[at]]).size == 1
        return f"{names[at] if one else nodes[at]}:{ways[at]}"
    return f"{_body(dataset)} {number}"


def _body(dataset: xr.Dataset) -> str:
    return "blade" if Description(dataset).lumped else "DOF"


def _kept(dataset: xr.Dataset) -> list[str]:
    """The degrees of freedom among which a response of a condensed structure is the largest."""
    return [f"of the {dataset.attrs[LARGEST_OF]}"] if LARGEST_OF in dataset.attrs else []


def _decibel(amplitude: float, units: str = "m") -> str:
    level = f" ({20 * np.log10(amplitude):.2f} dB re 1 {units})" if amplitude > 0 else ""
    return f"{amplitude:.6g} {units}{level}"


def _counted(counts: Counter) -> str:
    total = sum(counts.values())
    kinds = ", ".join(f"{number} {kind}" for kind, number in sorted(counts.items()))
    return f"{total}: {kinds}" if total else "none"


def _ranges(labels: Any) -> str:
    """Labels in short: 0 to 3, 7."""
    values = np.asarray(labels)
    breaks = np.flatnonzero(np.diff(values) != 1) + 1
    runs = np.split(values, breaks)
    return ", ".join(str(r[0]) if len(r) == 1 else f"{r[0]} to {r[-1]}" for r in runs)
