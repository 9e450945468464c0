"""Where degrees of freedom are, and the names by which contacts, forces and results call them."""

from symhbm.model.places.names import (
    DIRECTIONS,
    NextSector,
    Place,
    check_place,
    check_whole,
    next_sector,
    node_numbers,
    number_of,
    own_numbers,
)
from symhbm.model.places.table import Places, check_places

__all__ = [
    "DIRECTIONS",
    "NextSector",
    "Place",
    "Places",
    "check_place",
    "check_places",
    "check_whole",
    "next_sector",
    "node_numbers",
    "number_of",
    "own_numbers",
]
