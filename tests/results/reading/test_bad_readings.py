"""Tables, motions and points that a result does not have are refused in words."""

import pytest

import symhbm as sh
from tests.plot.test_same_pictures import result

data = sh.datasets
VALUE, KEY, TYPE = ValueError, KeyError, TypeError
LEFT_OUT = '["peak_coefficient"]'
BAD = [
    (lambda ds: data.table(3), TYPE, "result=3"),
    (lambda ds: data.table(ds, "rows"), VALUE, "kind='rows'"),
    (lambda ds: data.table(ds, each="blade"), VALUE, "each='blade'"),
    (lambda ds: data.table(ds, variables=["amplitud"]), KEY, "amplitud"),
    (lambda ds: data.table(ds, variables="amplitude"), TYPE, "variables='amplitude'"),
    (lambda ds: data.table(ds, variables=["peak_dof"]), VALUE, "variable 'peak_dof'"),
    (lambda ds: data.table(ds.drop_dims("peak"), "peaks"), VALUE, "table of peaks: the archive ha"),
    (lambda ds: data.table(ds, columns=["amplitude_9"]), KEY, "amplitude_9"),
    (lambda ds: data.table(ds, columns="frequency"), TYPE, "columns='frequency'"),
    (lambda ds: data.motion(3), TYPE, "result=3"),
    (lambda ds: data.motion(ds, "events"), VALUE, "kind='events'"),
    (lambda ds: data.motion(ds, angle=[[0.0]]), VALUE, "angle="),
    (lambda ds: data.motion(ds.drop_vars("coefficient")), KEY, "'coefficient'"),
    (lambda ds: data.trimmed(3), TYPE, "result=3"),
    (lambda ds: data.at(ds, 5), VALUE, "at=5: no curve has it.*10 to 30"),
    (lambda ds: data.at(ds, 99.0), VALUE, "at=99.0: no curve has it.*10 to 30"),
    (lambda ds: data.at(ds, "peeks"), VALUE, "at='peeks': expected one of 'peak', 'largest'"),
    (lambda ds: data.at(ds, [1]), VALUE, r"at=\[1\]: expected an integer >= 0"),
    (lambda ds: data.at(data.at(ds)), VALUE, "one point of each"),
    (lambda ds: data.at(ds.drop_vars("peak_coefficient").assign_attrs(left_out=LEFT_OUT), "peak"),
     KEY, "keep="),
]  # fmt: skip


@pytest.mark.parametrize(("call", "error", "words"), BAD)
def test_what_is_not_there_is_refused(call, error, words):
    with pytest.raises(error, match=words):
        call(result("loads"))
