"""Dry friction whose normal load varies with the motion: located slip, opening and closing."""

from symhbm.model.contacts.varying_load.batch import locate_normal, n_details
from symhbm.model.contacts.varying_load.law import Marched, VariableLoadFriction

__all__ = ["Marched", "VariableLoadFriction", "locate_normal", "n_details"]
