"""The optimisation problem of a design: aims, constraints, steps, and conditions of an optimum."""

from symhbm.design.program.aim import Aim
from symhbm.design.program.limits import Limits
from symhbm.design.program.optimum import ActiveSet
from symhbm.design.program.program import Program, Step
from symhbm.design.program.statistic import CaseStatistic, Statistic

__all__ = ["ActiveSet", "Aim", "CaseStatistic", "Limits", "Program", "Statistic", "Step"]
