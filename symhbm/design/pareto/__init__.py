"""Fronts of two aims: designs of which none is better in both."""

from symhbm.design.pareto.front import pareto_front

__all__ = ["pareto_front"]
