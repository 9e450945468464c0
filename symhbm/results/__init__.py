"""Datasets: the request, names and units of the variables, provenance."""

from symhbm.results import schema, tables, variables
from symhbm.results.blocks import consecutive_blocks
from symhbm.results.description import Description, records_of_problem
from symhbm.results.places import check_dof, of_places, places_of
from symhbm.results.provenance import (
    DRAWN,
    LARGEST_OF,
    SCHEMA_VERSION,
    law_of_library,
    variables_of_model,
    with_provenance,
)
from symhbm.results.request import (
    OF_PEAKS,
    Angles,
    Peaks,
    Request,
    check_band,
    check_grid,
    check_index,
    check_keep,
    check_parameter,
)
from symhbm.results.schema import check_dataset, check_present, recall, without
from symhbm.results.sweep import Sweep, parse
from symhbm.results.variables import OWN_DIMENSIONS, VARIABLES, meaning

__all__ = [
    "DRAWN",
    "LARGEST_OF",
    "OF_PEAKS",
    "OWN_DIMENSIONS",
    "SCHEMA_VERSION",
    "VARIABLES",
    "Angles",
    "Description",
    "Peaks",
    "Request",
    "Sweep",
    "check_band",
    "check_dataset",
    "check_dof",
    "check_grid",
    "check_index",
    "check_keep",
    "check_parameter",
    "check_present",
    "consecutive_blocks",
    "law_of_library",
    "meaning",
    "of_places",
    "parse",
    "places_of",
    "recall",
    "records_of_problem",
    "schema",
    "tables",
    "variables",
    "variables_of_model",
    "with_provenance",
    "without",
]
