"""The equations of harmonic balance, Eqs. (9)-(11), and their derivatives to second order."""

from symhbm.balance import goals
from symhbm.balance.batch import check_each, compile_checks, locate_each
from symhbm.balance.contacts import BalancedContacts, BalancedGroup, motions_at_each
from symhbm.balance.dynamic_stiffness import DynamicStiffness, losses
from symhbm.balance.equations import Equations
from symhbm.balance.evaluation import ContactStates, Evaluation, UnknownLayout
from symhbm.balance.goal_values import GoalOrder, ValueOf
from symhbm.balance.harmonic_balance import HarmonicBalance, check_problem
from symhbm.balance.mean_position import check_mean, is_held
from symhbm.balance.second_order import SecondOrder
from symhbm.balance.switching_angles import SwitchingAngles, check_odd, friction_of, slip_angles
from symhbm.balance.unforced import SustainedMotion, check_mass, matrices_in, unforced

__all__ = [
    "BalancedContacts",
    "BalancedGroup",
    "ContactStates",
    "DynamicStiffness",
    "Equations",
    "Evaluation",
    "GoalOrder",
    "HarmonicBalance",
    "SecondOrder",
    "SustainedMotion",
    "SwitchingAngles",
    "UnknownLayout",
    "ValueOf",
    "check_each",
    "check_mass",
    "check_mean",
    "check_odd",
    "check_problem",
    "compile_checks",
    "friction_of",
    "goals",
    "is_held",
    "locate_each",
    "losses",
    "matrices_in",
    "motions_at_each",
    "slip_angles",
    "unforced",
]
