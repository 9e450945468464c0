"""Records: fields to JSON and numbers and back, of classes that are defined, and of no others."""

import json
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp

import symhbm as sh
from symhbm.model import Excitation
from symhbm.model.linear import LowRankSum
from symhbm.model.records import (
    NotRebuiltError,
    NotStoredError,
    Record,
    digest_of,
    joined,
    pack,
    packed,
    unpack,
)
from symhbm.results.problem import NUMBERS


def again(value):
    parts: list[Any] = []
    told = json.loads(json.dumps(pack(value, parts)))
    return unpack(told, joined(parts))


class Grid(Record):
    """Fields of every kind."""

    def __init__(self, size):
        self.size, self.names = size, ("tip", "root")
        self.table = {2: 1 - 2j, 1: np.arange(3)}
        self.matrix = sp.csc_array(np.diag([1.0, 0.0, 2.0]))
        self.texts = np.array(["b", "a", "b"])
        self.flags = np.array([[True], [False]])
        self.phasors = np.array([1j, 0.1 + 1e-300j])


@dataclass(frozen=True, repr=False)
class Gust(Excitation):
    """A force of the user's own."""

    weights: Any
    amplitude: float = 1.0

    def shape(self, n_dof, basis):
        result = np.zeros((n_dof, basis.n_components))
        result[:, basis.component(1)] = self.weights
        return result


def test_fields_come_back_to_the_bit():
    one = Grid(3)
    other = again(one)
    assert type(other) is Grid
    assert (other.size, other.names, other.table[2]) == (3, ("tip", "root"), 1 - 2j)
    for name in ("texts", "flags", "phasors"):
        value, found = getattr(one, name), getattr(other, name)
        assert found.dtype.kind == value.dtype.kind
        np.testing.assert_array_equal(found, value)
    np.testing.assert_array_equal(other.table[1], one.table[1])
    np.testing.assert_array_equal(other.matrix.toarray(), one.matrix.toarray())


def test_matrices_in_factors_come_back():
    """Those of damping by modes of large structures and rings."""
    factors = np.arange(6.0).reshape(3, 2)
    one = LowRankSum(sp.csc_array(np.eye(3)), factors, 1j * factors)
    np.testing.assert_array_equal(again(one) @ np.eye(3), one @ np.eye(3))


def test_classes_that_are_not_defined_are_named_and_never_imported():
    parts: list[Any] = []
    told = pack(Grid(3), parts)
    for name, module in (("Popen", "subprocess"), ("Grind", told["from"])):
        with pytest.raises(NotRebuiltError, match=f"class {name} of {module}, .* import the file"):
            unpack(told | {"of": name, "from": module}, joined(parts))
    library = {"of": "Gust", "fields": {"weights": [1.0], "amplitude": 1.0}}
    with pytest.raises(NotRebuiltError, match="class Gust of symhbm"):
        unpack(library, np.zeros(0))


def test_one_class_of_a_name_serves_whatever_file_it_was_in():
    told = pack(Grid(3), parts := [])
    assert type(unpack(told | {"from": "__main__"}, joined(parts))) is Grid
    type("Grid", (Record,), {"__module__": "elsewhere"})
    assert type(unpack(told, joined(parts))) is Grid
    with pytest.raises(NotRebuiltError, match="class Grid of __main__"):
        unpack(told | {"from": "__main__"}, joined(parts))


def test_what_archives_do_not_hold_is_told():
    grid = Grid(3)
    grid.size = lambda: 3
    with pytest.raises(NotStoredError, match="function is nothing that archives hold"):
        pack(grid, [])
    told = packed(grid, [])
    with pytest.raises(NotRebuiltError, match="of Grid: function is nothing"):
        unpack(told, np.zeros(0))


def test_a_force_of_a_file_of_its_own_comes_back():
    model = sh.Model(np.eye(2), 5 * np.eye(2), np.diag([1e4, 2e4]))
    problem = sh.HarmonicBalance(model, Gust(np.array([1.0, 0.5]), 2.0))
    point = sh.solve(problem, 15.0)
    rebuilt = sh.datasets.rebuild(point)
    assert type(rebuilt.excitation) is Gust
    assert sh.solve(rebuilt, 15.0).coefficient.equals(point.coefficient)
    about = json.loads(point.attrs["problem"])
    about["excitation"]["of"] = "Storm"
    objects = {name: about[name] for name in ("structure", "excitation")}
    about["digest"] = digest_of(point[NUMBERS].values, objects)
    with pytest.raises(
        sh.datasets.ArchiveError, match=r"class Storm of .*test_records, which is not def"
    ):
        sh.datasets.rebuild(point.assign_attrs(problem=json.dumps(about)))
