"""What the attributes of a dataset say of its computation: one reader for all that ask."""

import json
from typing import Any

import xarray as xr


class Description:
    """The problem, the request and the checks behind a dataset, as far as its attributes tell."""

    def __init__(self, dataset: xr.Dataset):
        self._attributes = dataset.attrs

    def _read(self, name: str, otherwise: Any) -> Any:
        return json.loads(self._attributes[name]) if name in self._attributes else otherwise

    @property
    def problem(self) -> dict[str, Any]:
        """Structure, contacts, force and harmonics."""
        return self._read("problem", {})

    @property
    def lumped(self) -> bool:
        """Whether degrees of freedom are blades."""
        return bool(self.problem.get("lumped"))

    @property
    def condensed(self) -> dict[str, Any] | None:
        """What tells a condensed structure apart, None for a whole one."""
        return self.problem.get("condensed")

    @property
    def structure(self) -> dict[str, Any] | None:
        """The class of a structure without matrices that is not condensed, None for others."""
        return self.problem.get("structure")

    @property
    def request(self) -> dict[str, Any]:
        """What was followed, by the names of `symhbm.results.Task`; the frequency at one point."""
        return self._read("followed", {"name": "frequency"})

    @property
    def moving(self) -> str:
        """Name of the parameter along which a response was followed."""
        return self.request["name"]

    @property
    def per_dof(self) -> bool:
        """Whether peaks are those of each degree of freedom."""
        return self.request.get("peaks") == "each"

    @property
    def swept(self) -> list[str]:
        """Names of the parameters that differ between curves."""
        return self._read("swept", [])

    @property
    def left_out(self) -> list[str]:
        """Names of results that were computed and not kept."""
        return self._read("left_out", [])

    @property
    def verification(self) -> dict[str, Any] | None:
        """The report of `symhbm.verify`, None where there was none."""
        return self._read("verification", None)
