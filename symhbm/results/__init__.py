"""Datasets: the request, names and units of the variables, provenance."""

from symhbm.results import parts, runs, schema, tables, variables
from symhbm.results.description import Description, records_of_problem, values_of, variables_of
from symhbm.results.problem import NUMBERS, law_of
from symhbm.results.provenance import (
    DRAWN,
    SCHEMA_VERSION,
    DatasetParts,
    of_places,
    places_of,
    with_provenance,
)
from symhbm.results.request import (
    OF_PEAKS,
    Angles,
    Peaks,
    Request,
    check_axis,
    check_band,
    check_grid,
    check_keep,
)
from symhbm.results.runs import Run
from symhbm.results.schema import check_dataset, check_forced, check_present, recall, without
from symhbm.results.sweep import Sweep, parse, scale
from symhbm.results.variables import OF_LAWS, OWN_DIMENSIONS, SLOPES, VARIABLES, meaning

__all__ = [
    "DRAWN",
    "NUMBERS",
    "OF_LAWS",
    "OF_PEAKS",
    "OWN_DIMENSIONS",
    "SCHEMA_VERSION",
    "SLOPES",
    "VARIABLES",
    "Angles",
    "DatasetParts",
    "Description",
    "Peaks",
    "Request",
    "Run",
    "Sweep",
    "check_axis",
    "check_band",
    "check_dataset",
    "check_forced",
    "check_grid",
    "check_keep",
    "check_present",
    "law_of",
    "meaning",
    "of_places",
    "parse",
    "parts",
    "places_of",
    "recall",
    "records_of_problem",
    "runs",
    "scale",
    "schema",
    "tables",
    "values_of",
    "variables",
    "variables_of",
    "with_provenance",
    "without",
]
