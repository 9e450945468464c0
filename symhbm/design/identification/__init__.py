"""Identification: parameters from measurements, how sure they are, and what to measure next."""

from symhbm.design.identification.experiment import next_measurements
from symhbm.design.identification.identify import identify

__all__ = ["identify", "next_measurements"]
