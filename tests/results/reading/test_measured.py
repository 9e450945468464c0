"""Measurements of arrays, tables and files become one dataset, and bad ones are refused."""

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat

import symhbm as sh

measured = sh.datasets.measured
FREQUENCY = np.array([10.0, 15.0, 20.0])
RESPONSE = np.array([[1 - 2j, 3 - 4j, 5 - 6j], [2 - 1j, 4 - 3j, 6 - 5j]])


def test_rows_are_real_numbers_in_si_units():
    data = measured(
        FREQUENCY, RESPONSE, units="mm", deviation=0.1, place="tip", force_amplitude=[[1], [2]]
    )
    assert data.sizes == {"measurement": 12}
    assert data.measured_form.values[:2].tolist() == ["real", "imaginary"]
    np.testing.assert_allclose(data.measured_value[:4], [1e-3, -2e-3, 3e-3, -4e-3])
    np.testing.assert_allclose(data.measured_deviation, 1e-4)
    np.testing.assert_allclose(data.measured_frequency[:4], [10, 10, 15, 15])
    np.testing.assert_allclose(data.measured_at_force_amplitude[[0, -1]], [1, 2])
    assert set(data.measured_place.values) == {"tip"}


@pytest.mark.parametrize(
    ("units", "form", "quantity", "factor"),
    [
        ("um", "magnitude", "displacement", 1e-6),
        ("g", "magnitude", "acceleration", 9.80665),
        ("mm s-1", "magnitude", "velocity", 1e-3),
        ("deg", "phase", "displacement", np.pi / 180),
    ],
)
def test_units_tell_the_quantity(units, form, quantity, factor):
    data = measured(FREQUENCY, [1.0, 2.0, 3.0], units=units, form=form)
    assert set(data.measured_quantity.values) == {quantity}
    np.testing.assert_allclose(data.measured_value, factor * np.array([1.0, 2.0, 3.0]))
    assert np.isnan(data.measured_deviation).all()


def table():
    return pd.DataFrame(
        {"f": FREQUENCY, "re": [1.0, 2, 3], "im": [-1.0, -2, -3], "F": 2.0, "where": "tip"}
    )


@pytest.mark.parametrize("kind", ["pandas", "mapping", "csv", "mat"])
def test_columns_of_tables(tmp_path, kind):
    of_table = table()
    given = of_table
    if kind == "mapping":
        given = {name: of_table[name].to_numpy() for name in of_table}
    if kind == "csv":
        given = tmp_path / "sweep.csv"
        of_table.to_csv(given, index=False)
    if kind == "mat":
        given = tmp_path / "sweep.mat"
        savemat(given, {name: of_table[name].to_numpy() for name in ("f", "re", "im", "F")})
    place = "tip" if kind == "mat" else "where"
    data = measured("f", ("re", "im"), units="m", table=given, force_amplitude="F", place=place)
    expected = measured(
        FREQUENCY, np.array([1, 2, 3]) * (1 - 1j), units="m", force_amplitude=2, place="tip"
    )
    assert data.identical(expected)


@pytest.mark.parametrize(
    ("change", "kind", "words"),
    [
        (dict(units="furlong"), ValueError, "units='furlong': expected one of 'm'"),
        (dict(units="g", quantity="velocity"), ValueError, "expected those of a velocity"),
        (dict(units="m", form="phase"), ValueError, "'rad' or 'deg'"),
        (dict(response=[1, np.nan, 3]), ValueError, "1 of 3 are not finite, the first at 15 Hz"),
        (dict(response=[1, 2]), ValueError, "shapes that go together"),
        (dict(response=["a", "b", "c"]), ValueError, "two columns"),
        (dict(response=[-1.0, 1, 1], form="magnitude"), ValueError, "no less than 0"),
        (dict(response=[1j, 1, 1], form="magnitude"), ValueError, "form='complex'"),
        (dict(frequency=[0.0, 1, 2]), ValueError, "frequency"),
        (dict(deviation=0.0), ValueError, "deviation"),
        (dict(sweep="sideways"), ValueError, "'up', 'down'"),
        (dict(harmonic=1.5), ValueError, "integers"),
        (dict(left_out=1), TypeError, "True or False"),
        (dict(form="polar"), ValueError, "one of 'complex'"),
        (dict(table=3), TypeError, "a table of pandas"),
        (dict(devation=0.1), TypeError, "devation: expected a parameter"),
        (dict(table="sweep.txt"), ValueError, ".csv or a .mat"),
        (dict(table="sweep.csv"), FileNotFoundError, "table='sweep.csv': expected a file"),
        (dict(response="amplitude", table={"f": [1]}), KeyError, "column of the table"),
    ],
)
def test_bad_measurements_are_refused(change, kind, words):
    given = dict(frequency=FREQUENCY, response=[1.0, 2, 3], units="m") | change
    with pytest.raises(kind, match=r"expected|allowed") as caught:
        measured(given.pop("frequency"), given.pop("response"), **given)
    assert words in str(caught.value)


def test_units_are_required():
    with pytest.raises(TypeError, match="units"):
        measured(FREQUENCY, [1.0, 2, 3])  # pyright: ignore[reportCallIssue]


def test_what_is_left_out_stays():
    response = np.array([1.0, np.nan, 3.0])
    data = measured(FREQUENCY, response, units="m", left_out=~np.isfinite(response))
    assert data.measured_left_out.values.tolist() == [0, 0, 1, 1, 0, 0]
