"""The optimisation problem of a design: aims, constraints, steps, and conditions of an optimum."""

from symhbm.design.program.aim import Aim, CaseStatistic, Limits, Statistic
from symhbm.design.program.optimum import ActiveSet
from symhbm.design.program.program import Program

__all__ = ["ActiveSet", "Aim", "CaseStatistic", "Limits", "Program", "Statistic"]
