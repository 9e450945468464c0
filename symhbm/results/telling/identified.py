"""Text on a fit: its status, each unknown with its error and interval, and the certificate."""

import numpy as np

from symhbm.results.telling.words import Rows, Words, certificate

_DIMS = {"unknown", "measurement", "curve", "direction", "fit_start"}


def identified(words: Words) -> Rows:
    """Labels and texts on a fit, none of other datasets."""
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


def of_fits(words: Words) -> set[str]:
    """Names of variables that `identified` tells, or are too many to be told."""
    dataset = words.dataset
    if "estimate" not in dataset.variables:
        return set()
    own = {str(name) for name, of in dataset.variables.items() if _DIMS & {*map(str, of.dims)}}
    return own | {"noise_level"}
