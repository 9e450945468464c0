"""One number per sample, from an array or a dataset, and labelled results of their statistics."""

from importlib.metadata import version
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from symhbm.ensembles.statistics.population import counted, missing_samples, origin
from symhbm.numerics import FloatArray, check
from symhbm.results import SCHEMA_VERSION
from symhbm.results.archive import check_schema

Values = ArrayLike | xr.DataArray | xr.Dataset


class Numbers(NamedTuple):
    """The numbers of the samples that did not fail, in their order, with units and meaning.

    ``n_missing`` samples of the ensemble are not there. ``source`` holds the parameters and the
    problem behind them, as far as they are known.
    """

    values: FloatArray
    n_failed: int
    n_missing: int
    units: str
    meaning: str
    source: xr.Dataset

    def labelled(self, result: xr.Dataset, title: str) -> xr.Dataset:
        """The result with the number of samples, the source and a title."""
        result = counted(result, self.values.size, self.n_failed, self.n_missing, "numbers used")
        versions = {"symhbm_schema": SCHEMA_VERSION, "symhbm_version": version("symhbm")}
        result = result.assign(self.source.data_vars).assign_attrs(versions | self.source.attrs)
        return result.assign_attrs(title=title, of=self.meaning)


def numbers(values: Values, of: str) -> Numbers:
    """Read one number per sample; NaN is a sample that failed, and is counted.

    ``values`` (n_samples,), or a dataset whose variable ``of`` they are. Raises TypeError,
    ValueError and KeyError for anything else, and where all failed.
    """
    source, waiting, n_others = xr.Dataset(), np.array(False), 0
    if isinstance(values, xr.Dataset):
        check_schema(values, "values")
        check.known(of, [str(name) for name in values.data_vars], "variable of the dataset")
        if "status" in values and values["status"].dims == values[of].dims:
            waiting, n_others = missing_samples(values)
        values, source = values[of], origin(values, values[of].dims)
    attributes = values.attrs if isinstance(values, xr.DataArray) else {}
    array = np.asarray(values)
    if array.dtype.kind not in "iuf":
        raise TypeError(f"values={check.shown(values)}: expected real numbers")
    if array.ndim != 1:
        raise ValueError(f"values: expected one number per sample, got shape {array.shape}")
    used, n_waiting = array[~np.isnan(array) & ~waiting].astype(float), int(waiting.sum())
    check.array("values", used)
    if used.size == 0:
        why = f"{array.size - n_waiting} did" + f", {n_waiting} are not computed" * bool(n_waiting)
        raise ValueError(f"values: expected a sample that did not fail, {why}")
    units, meaning = str(attributes.get("units", "1")), str(attributes.get("long_name", "values"))
    n_failed = array.size - used.size - n_waiting
    return Numbers(used, n_failed, n_waiting + n_others, units, meaning, source)


def check_confidence(confidence: float) -> float:
    """Return a probability between 0 and 1, both excluded; raise ValueError for any other."""
    confidence = check.scalar("confidence", confidence, "positive")
    if confidence >= 1:
        raise ValueError(f"confidence={confidence:g}: expected a probability below 1")
    return confidence


def check_probabilities(name: str, values: ArrayLike) -> FloatArray:
    """Return probabilities between 0 and 1, both excluded; raise ValueError for any other."""
    array = check.array(name, values, "positive")
    if array.ndim != 1 or array.size == 0 or np.any(array >= 1):
        raise ValueError(f"{name}={check.shown(values)}: expected probabilities between 0 and 1")
    return array


BOUND = ("bound", np.array(["lower", "upper"], dtype=object), {"long_name": "end of the interval"})
"""Coordinate of intervals."""
