"""What an optimal load costs, in frequency responses: ``pytest tests/benchmarks -k design``."""

import time

import pytest

import symhbm as sh
from studies import fig03_single_blade as fig03
from tests.benchmarks.problems import ring

CASES = {
    "blade (1,)": (fig03.problem, (0.05, 500.0), (5.0, 40.0)),
    "ring (1,)": (lambda: ring((1,), 10), (0.1, 100.0), (5.0, 350.0)),
    "ring (1, 3, 5)": (lambda: ring((1, 3, 5), 10), (0.1, 100.0), (5.0, 350.0)),
}


@pytest.mark.parametrize("case", CASES)
def test_optimum_over_one_response(benchmark, case):
    """The ratio of the two is in ``extra_info``, the certificate included."""
    build, bounds, band = CASES[case]
    problem = build()

    def once(function, *arguments):
        start = time.process_time()
        result = function(problem, *arguments, progress=False)
        return time.process_time() - start, result

    response = min(once(sh.frf, band)[0] for _ in range(5))
    spent, best = benchmark.pedantic(
        once, (sh.minimise_peak, "normal_load", bounds, band), rounds=3, warmup_rounds=1
    )
    benchmark.extra_info["frequency responses"] = round(spent / response, 1)
    assert best.status.item() == sh.Status.DESIGN_OPTIMAL
