"""Peaks followed over a parameter, and the highest of them all."""
