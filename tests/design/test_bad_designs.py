"""Designs that cannot be asked for are refused: with argument, value and what is allowed."""

import casadi as ca
import numpy as np
import pytest
from scipy.optimize import Bounds, LinearConstraint, NonlinearConstraint
from xarray import DataArray

import symhbm as sh
from tests.designs import BAND, BOUNDS, blade, design, ring

BOTH = ["normal_load", "damping"]
ONE, FREE = np.ones((1, 1)), sh.Model(np.eye(2), 0.5 * np.eye(2), 1e4 * np.eye(2))
SAMPLED = sh.HarmonicBalance(blade().model, blade().excitation, (1,), samples=64)
TWO = dict(over={"damping": DataArray([0.5, 0.6], dims="case")})
BY_CASE = dict(frequency_band=DataArray([[1.0, 2]] * 3, dims=("case", "edge")))
EXCHANGED = DataArray([[1.0, 2]] * 2, {"damping": [0.6, 0.5]}, ("damping", "edge"))
OF_EACH = DataArray([[5.0, 40.0], [5.0, 41.0]], dims=("damping", "edge"))
CROSSED = dict(damping=(1, 2), normal_load=(2, 1))
NO_ROW = LinearConstraint([[1.0], [0.0]], 0, 2)
APART = [LinearConstraint([[1]], 5, 9), LinearConstraint([[1]], 1, 4)]


def linear(row, low, high):
    return dict(constraint=LinearConstraint(row, low, high))


def curved(function, low=0, high=4, **more):
    return dict(constraint=NonlinearConstraint(function, low, high, **more))


def aim(function, **more):
    return dict(objective=function) | more


def weighted(peaks, parameters):
    return peaks["largest"] + 2e-5 * parameters["normal_load"][0]


def own_symbol(peaks, parameters):
    return ca.SX.sym("own") * peaks["largest"]


OF_RINGS = {
    KeyError: [
        (dict(parameters="normal_lod"), "'normal_lod' is no .* did you mean 'normal_load'"),
        (dict(parameters="engine_order"), "'engine_order' is no parameter that"),
        (dict(fresh={"dampin": [1]}), "'dampin' is no parameter"),
    ],
    TypeError: [
        (dict(parameters=[]), r"parameters=\[\]: expected a name or several"),
        (dict(parameters=["normal_load"] * 2), "parameters=.*different ones"),
        (dict(parameters=3), "parameters=3: expected a name"),
        (dict(bounds=None), "bounds=None: expected real numbers"),
        (dict(parameters=BOTH, bounds=(1, 2)), r"bounds=\(1, 2\): expected a mapping with an entr"),
        (dict(constraint=2.0), "constraint=2.0: expected a scipy.optimize.L"),
        (dict(over=[1]), r"over=\[1\]: expected a mapping of parameters"),
        (dict(fresh=[1]), r"fresh=\[1\]: expected a mapping of parameters"),
        (dict(problem=FREE), r"problem=.*expected a HarmonicBalance"),
    ],
    ValueError: [
        (dict(bounds=(5, 1)), r"bounds=\(5, 1\): expected two.* lower < upper"),
        (dict(bounds=(-1, 1)), r"bounds=\(-1, 1\): .*finite and > 0"),
        (dict(bounds=(1, np.inf)), r"bounds=\(1, inf\): .*finite and > 0"),
        (dict(bounds=5), "bounds=5: expected two values"),
        (dict(parameters=BOTH, bounds={"damping": (1, 2)}), "bounds=.*an entry for 'normal_load'"),
        (dict(parameters=BOTH, bounds=CROSSED), r"bounds\['normal_load'\]=\(2, 1\): .*lower < upp"),
        (dict(bounds={"normal_load": (1, 2), "dampin": (1, 2)}), "'dampin' is not designed"),
        (dict(bounds=Bounds(3, 1)), "bounds: .*lower < upper for normal"),
        (dict(bounds=Bounds(0, 1)), "bounds.lb=.*finite and > 0"),
        (dict(bounds=Bounds([1, 2], 3)), "bounds.lb=.*1 variables"),
        (dict(vary="eech"), "vary='eech': expected 'common', 'each', or a seq"),
        (dict(vary=[0, 1, 2, 3]), r"vary=\[0, .*no longer than the 3 val"),
        (dict(vary=[0, 0.5]), r"vary=\[0, 0.5\]: expected 'common'"),
        (dict(vary={"mass": "each"}), "vary=.*'mass' is not designed"),
        (dict(start=[1, 2]), r"start=\[1, 2\]: expected one value.*1 variables, got shape \(2,\)"),
        (dict(start=-1), "start=-1: expected values finite and > 0"),
        (dict(frequency_band=(1, 2, 3)), r"frequency_band=\(1, 2, 3\): expected two diff"),
        (dict(frequency_band=(5, 5)), r"frequency_band=\(5, 5\): expected bands of som"),
        (dict(frequency_band=[]), r"frequency_band=\[\]: expected two different"),
        (dict(frequency_band=np.ones((2, 2, 2))), "frequency_band=array.*a list of such"),
        (BY_CASE | TWO, "frequency_band=.*over the dimensions of the sweep, {'case': 2}"),
        (dict(frequency_band=EXCHANGED, over={"damping": [0.5, 0.6]}), "the labels .0.6, 0.5., th"),
        (dict(frequency_band=OF_EACH, over={"damping": [0.5, 0.6]}, fresh={"damping": [0.7]}),
         "fresh: expected None where cases have bands of thei"),
        (dict(statistic="tail", tail=0), "tail=0: expected a share above 0"),
        (dict(tail=1.5), "tail=1.5: expected a share above 0, up to 1"),
        (dict(statistic="wurst"), "statistic='wurst': expected 'worst', 'mea"),
        (linear(np.ones((1, 2)), 1, 2), r"constraint: .*matrix with 1 columns.* got shape \(1, 2"),
        (dict(constraint=NO_ROW), "constraint: expected rows .*other than 0, row 1 has none"),
        (linear(ONE, np.nan, 2), "constraint: expected numbers as bounds.* lb=.*nan"),
        (linear(ONE, np.inf, np.inf), "constraint: expected numbers as bounds.* lb=.*inf"),
        (linear(ONE, 600.0, 700.0), "constraint: expected limits that some values"),
        (dict(n_starts=0), "n_starts=0: expected an integer >= 1"),
        (dict(over={"normal_load": [0.0, 1.0]}), r"over\['normal_load'\]: expected positive value"),
        (dict(over={"damping": DataArray([0.5, 0.6], dims="start")}), "'start' is the result's"),
        (dict(fresh={"normal_load": [0.0, 1.0]}), r"fresh\['normal_load'\]: expected positive"),
        (dict(over={"force_amplitude": [0.0, 1.0]}), "force_amplitude=0: expec"),
        (dict(problem=SAMPLED), r"problem: expected located switching angles.*64 samp"),
        (dict(problem=blade(normal_load=0.0), over={"normal_load": [1.0, 2.0]}),
         r"over\['normal_load'\]: expected positive nominal"),
        (dict(problem=sh.HarmonicBalance(FREE, sh.forces.PointForce())),
         "parameters='normal_load': expected contacts"),
    ],
}  # fmt: skip
OF_BLADES = {
    TypeError: [
        (aim(3), "objective=3: expected a function of peaks"),
        (aim(lambda peaks: 1), "objective: .*it raised TypeErr"),
        (aim(lambda p, q: 1.0), "objective: .*got 1.0, a number that"),
        (aim(lambda p, q: None), "objective: expected .*got None"),
        (aim(lambda p, q: p["largest"] if p["largest"] > 0 else 0), "objective: .*symbols go thro"),
        (dict(peaks={"a": {}}), "objective=None: expected a function"),
        (dict(peaks={}), "peaks={}: expected a mapping of names"),
        (dict(peaks={"a": 3}), r"peaks\['a'\]=3: expected a name, and a"),
        (dict(peaks={"a": {"problem": 4}}), r"peaks\['a'\]\['problem'\]=4: expected a HarmonicBal"),
        (curved(lambda x: 3.0), "constraint.fun: expected an expression of CasADi's symbols"),
        (dict(constraint=lambda p: p["normal_load"]), "constraint: expected relations of paramete"),
        (dict(constraint=lambda p: 1 <= p["normal_load"] <= 2), "constraint: .*symbols go through"),
        (dict(constraint=lambda p: p["mass"] <= 2), "constraint: expected"),
    ],
    KeyError: [
        (aim(lambda p, q: p["a"]), "'a' is no peak; .*largest"),
        (aim(lambda p, q: q["normal_lod"]), "objective: 'normal_lod' is .*did you mean 'normal_lo"),
    ],
    ValueError: [
        (aim(lambda p, q: q["mass"]), "objective: .*no design chan"),
        (aim(lambda p, q: [p["largest"]] * 2), r"objective: expected one .*got one of shape \(2, "),
        (aim(lambda p, q: p["largest"] * np.nan), "objective: expected a positive number, got nan"),
        (aim(lambda p, q: -p["largest"]), "positive number, got -0.0003.* with largest = 0.0003"),
        (aim(lambda p, q: 1 / p["largest"]), "objective: .*falls with no peak that rises; .*'larg"),
        (aim(own_symbol), "objective: .*has own of its own"),
        (aim(weighted, fresh={"damping": [0.4]}), "fresh: expected None .*with an objective"),
        (dict(peaks={"a": {"freq": (5, 6)}}), r"peaks\['a'\]: expected any of .*got 'freq'"),
        (dict(peaks={"a": {"frequency": (5, 5)}}), r"peaks\['a'\]\['frequency'\]=\(5, 5\): .*widt"),
        (dict(peaks={"a": {"dof": 4}}), r"peaks\['a'\]\['dof'\]: .*0 to 0"),
        (dict(peaks={"a": {"problem": ring(3)}}), r"peaks\['a'\]\['problem'\]: .*1 values.*got 3"),
        (dict(constraint=APART), r"constraint\[0\] and constraint\[1\]: expected limits that some"),
        (dict(constraint=[*APART[1:], lambda p: p["normal_load"] >= 501]), r"^constraint\[1\]: ex"),
        (curved(lambda x: x[0] ** 2, 4, 2), "constraint: .*no larger than upper ones, row 0 has 4"),
        (curved(lambda x: x[0] ** 2, jac=lambda x: [[x[0]]]), "constraint.jac: expected the deriv"),
        (curved(lambda x: ca.sqrt(x[0] - 5)), "constraint: expected finite numbers .*row 0 has"),
    ],
}  # fmt: skip


@pytest.mark.parametrize(
    ("problem", "error", "options", "words"),
    [
        (problem, error, *row)
        for problem, table in ((ring(3, 1e5, 1), OF_RINGS), (blade(), OF_BLADES))
        for error, rows in table.items()
        for row in rows
    ],
)
def test_it_is_named_with_its_value_and_what_is_allowed(problem, error, options, words):
    given = dict(problem=problem, names="normal_load", bounds=BOUNDS, frequency_band=BAND) | options
    names = given.pop("parameters", given.pop("names"))
    with pytest.raises(error, match=words):
        design(given.pop("problem"), names, **given)
