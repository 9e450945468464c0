"""The account of a dataset: sections of labels and texts, and the text of all of them."""

import textwrap
from collections.abc import Iterator

import numpy as np
import xarray as xr

from symhbm.results import NUMBERS, VARIABLES, parts
from symhbm.results.reading import curve_status, printable, read
from symhbm.results.telling.findings import findings
from symhbm.results.telling.problem import MOST_LISTED, problem
from symhbm.results.telling.words import Rows, Words, certificate, designs

WIDTH, MARGIN = 100, 24
"""Width of a line, and of its label."""
_DESCRIBED_ATTRIBUTES = {
    *("title", "references", "symhbm_schema", "symhbm_version", "casadi_version"),
    *("problem", "swept", "followed", "accuracy", "left_out", "verification"),
    *(parts.PART, parts.COMPUTED, parts.MERGED),
}
_OF_FITS = {"unknown", "measurement", "curve", "direction", "fit_start"}
"""Dimensions of variables on a fit."""


def account(dataset: xr.Dataset, digits: int = 6) -> Iterator[tuple[str, Rows]]:
    """What a dataset is and holds, section by section, each with rows of labels and texts.

    Variables are read one at a time, block by block: a lazily opened archive may be larger than
    the memory. Numbers have so many significant ``digits``.
    """
    words = Words(dataset, digits)
    yield "origin", _origin(dataset)
    yield "problem", problem(words)
    if curve_status(dataset) is not None:
        yield "results", findings(words)
    yield "design", designs(words)
    yield "identification", _identified(words)
    yield "others", _others(words)


def as_text(dataset: xr.Dataset) -> str:
    """The account of a dataset, a line or more for each label."""
    rows = [row for _, section in account(dataset) for row in section]
    return "\n".join(line for name, text in rows for line in lines_of(name, text))


def lines_of(label: str, text: str, nothing: str = "") -> list[str]:
    """A text beside its label, in lines of one width."""
    lines = textwrap.wrap(printable(text), WIDTH - MARGIN, break_on_hyphens=False) or [nothing]
    labels = [printable(label), *[""] * len(lines)]
    return [f"{a:<{MARGIN - 1}} {b}".rstrip() for a, b in zip(labels, lines, strict=False)]


def _origin(dataset: xr.Dataset) -> Rows:
    attributes = dataset.attrs
    yield "title", str(attributes.get("title", "none"))
    made = {"symhbm": "symhbm_version", "CasADi": "casadi_version", "schema": "symhbm_schema"}
    by = [f"{maker} {attributes[key]}" for maker, key in made.items() if key in attributes]
    yield "made by", ", ".join(by)
    if "references" in attributes:
        yield "reference", str(attributes["references"])


def _identified(words: Words) -> Rows:
    """Status of a fit, each unknown with error and interval, and the certificate; else nothing."""
    dataset, short = words.dataset, words.short
    if "estimate" not in dataset.variables:
        return
    yield "identification", str(dataset["status"].item())
    names = ("unknown", "unknown_units", "estimate", "standard_error", "profile_interval")
    for label, units, value, error, ends in zip(*(dataset[n].values for n in names), strict=True):
        unit = "" if units == "1" else f" {units}"
        text = f"{words.within(value, error)}{unit}"
        text += "" if np.isfinite(error) else ", standard error not known"
        if np.isfinite(ends).all():
            text += f", interval {short(ends[0])} to {short(ends[1])}{unit}"
        yield f"  {label}", text
    yield from certificate(words)


def _of_fits(words: Words) -> set[str]:
    """Names of variables that `_identified` tells, or are too many to be told."""
    dataset = words.dataset
    if "estimate" not in dataset.variables:
        return set()
    own = {str(name) for name, of in dataset.variables.items() if _OF_FITS & {*map(str, of.dims)}}
    return own | {"noise_level"}


def _others(words: Words) -> Rows:
    """What was left out; variables and attributes of the user; all where there is no status."""
    dataset, parameters = words.dataset, words.description.parameters
    if words.description.left_out:
        yield "left out by keep=", ", ".join(words.description.left_out)
    described = {*VARIABLES, *parameters, "harmonic", "component", "dof", "contact"}
    followed = [*parameters, words.along]
    described |= {f"{prefix}_{name}" for prefix in ("peak", "event") for name in followed}
    described |= {f"{name}_nominal" for name in parameters}
    described |= {NUMBERS, *parts.variables_of_whole(dataset), *_of_fits(words)}
    if curve_status(dataset) is None:
        described -= {str(name) for name in dataset.data_vars} - {*parameters}
        sizes = ", ".join(f"{size} {dim}" for dim, size in dataset.sizes.items())
        yield "dimensions", sizes or "none"
    for name, variable in dataset.variables.items():
        if name in described:
            continue
        attributes = variable.attrs
        unit = "" if attributes.get("units", "1") == "1" else f" {attributes['units']}"
        text = [f"{attributes['long_name']}"] if attributes.get("long_name", name) != name else []
        text += [f"along {', '.join(map(str, variable.dims))}"] if variable.dims else []
        yield f"{name}", ", ".join([*text, _spread(words, str(name)) + unit])
    for name, value in dataset.attrs.items():
        if name not in _DESCRIBED_ATTRIBUTES:
            yield str(name), textwrap.shorten(str(value), 2 * WIDTH, placeholder=" ...")


def _spread(words: Words, name: str) -> str:
    low, high, missing, size = np.inf, -np.inf, 0, 0
    if words.dataset[name].dtype.kind not in "iufb":
        values = list(dict.fromkeys(map(str, words.dataset[name].values.ravel().tolist())))
        more = ", ..." if len(values) > MOST_LISTED else ""
        return ", ".join(values[:MOST_LISTED]) + more
    for _, values in read(words.dataset, name):
        numbers = values[~np.isnan(values)]
        size, missing = size + values.size, missing + values.size - numbers.size
        if numbers.size:
            low, high = min(low, numbers.min()), max(high, numbers.max())
    if missing == size:
        return f"{size} values, none known" if size else "no values"
    text = words.span([low, high])
    return f"{text} ({missing} of {size} are NaN)" if missing else text
