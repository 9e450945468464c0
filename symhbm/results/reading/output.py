"""`output`: a result as one of its linear outputs tells it, for all that reads displacements."""

from __future__ import annotations

import numpy as np
import xarray as xr

from symhbm.numerics import check
from symhbm.results.description import OUTPUT, Description
from symhbm.results.schema import check_dataset, check_present

_PARTS = ("amplitude", "coefficient")


def output(result: xr.Dataset, name: str) -> xr.Dataset:
    """A result in which a linear output takes the place of displacements.

    ``amplitude`` and ``coefficient`` are those of the output in its units, and ``dof`` numbers its
    rows, so that `symhbm.datasets.motion`, `symhbm.datasets.table`, `symhbm.statistics` and
    `symhbm.plot.response` take it as they take any result. Peaks are there where they are those of
    this output, of a problem with ``peaks_of=name``.

    Parameters
    ----------
    result
        A result of `frf`, `follow`, `solve` or `recover` of a model with outputs, in memory or
        loaded.
    name
        What the output is called.

    Raises
    ------
    TypeError, KeyError
        For what is no dataset, and for an output that it does not hold.

    Examples
    --------
    >>> import symhbm as sh
    >>> pair = sh.Model(
    ...     [[1, 0], [0, 1]], [[0.5, 0], [0, 0.5]], [[2e4, -1e4], [-1e4, 1e4]]
    ... ).with_outputs({"stress": {0: -1e9, 1: 1e9}}, units="Pa")
    >>> problem = sh.HarmonicBalance(pair, sh.forces.PointForce(), peaks_of="stress")
    >>> stress = sh.datasets.output(sh.frf(problem, (5, 40)), "stress")
    >>> sh.datasets.motion(stress, "peaks").phase_lag.dims, stress.peak_amplitude.values.round(0)
    (('peak', 'dof', 'harmonic'), array([ 5528121., 14472141.]))
    """
    check_dataset("result", result)
    description = Description(result)
    outputs = description.outputs
    check.known(check.text("name", name), outputs, "output of the result")
    about = outputs[name]
    check_present(result, f"{name}_amplitude", container="result")
    own = description.problem.get("peaks_of") == name
    dropped = [str(n) for n in result.variables if _is_dropped(result, str(n), description, own)]
    view = result.drop_vars(dropped)
    if "dof" in view.dims:
        view = view.rename({"dof": "blade"})
    for part in _PARTS:
        if f"{name}_{part}" not in result.variables:
            continue
        values = result[f"{name}_{part}"].variable
        if about.several:
            dims = ["dof" if dim == about.inner[0] else dim for dim in values.dims]
            view[part] = xr.Variable(dims, values.data, values.attrs)
        else:
            outer = values.ndim - sum(dim in ("harmonic", "component") for dim in values.dims)
            dims = (*values.dims[:outer], "dof", *values.dims[outer:])
            view[part] = xr.Variable(dims, np.expand_dims(values.values, outer), values.attrs)
    if own and "peak_coefficient" in result.variables:
        stored = result["peak_coefficient"].variable
        of_dofs = stored.transpose("dof", ...)
        flat = of_dofs.values.reshape(of_dofs.shape[0], -1)
        rows = np.where(np.isnan(flat).any(axis=0), np.nan, about.rows @ flat)
        words = f"Fourier coefficient of the {name.replace('_', ' ')} at the peak"
        attributes = {"units": about.units, "long_name": words}
        peaks = xr.Variable(of_dofs.dims, rows.reshape(len(rows), *of_dofs.shape[1:]), attributes)
        view["peak_coefficient"] = peaks.transpose(*stored.dims)
    numbers = np.arange(about.rows.shape[0])
    words = {"long_name": f"row of the {name.replace('_', ' ')}", "units": "1"}
    return view.assign_coords(dof=("dof", numbers, words)).assign_attrs({OUTPUT: name})


def _is_dropped(result: xr.Dataset, name: str, description: Description, own: bool) -> bool:
    """Whether a variable is of displacements, of another output or of places."""
    variable = result.variables[name]
    if "peak" in variable.dims:
        return not own or name == "peak_coefficient"
    kept = {*description.parameters, *description.swept}
    kept |= {f"{parameter}_nominal" for parameter in kept}
    return "dof" in variable.dims and (name not in kept or not description.lumped)
