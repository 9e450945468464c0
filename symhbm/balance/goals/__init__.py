"""Goals: what is asked of a solution and made small, or followed in the place of an amplitude."""

from symhbm.balance.goals.dissipation import Dissipation
from symhbm.balance.goals.goal import ContactSymbols, Goal, Solution
from symhbm.balance.goals.mean_displacement import MeanDisplacement
from symhbm.balance.goals.mean_normal_force import MeanNormalForce
from symhbm.balance.goals.slip_distance import SlipDistance

__all__ = [
    "ContactSymbols",
    "Dissipation",
    "Goal",
    "MeanDisplacement",
    "MeanNormalForce",
    "SlipDistance",
    "Solution",
]
