"""Dry friction whose normal load varies with the motion: located slip, opening and closing."""

from symhbm.model.contacts.varying_load.law import VariableLoadFriction

__all__ = ["VariableLoadFriction"]
