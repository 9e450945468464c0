"""The programs that are compared: each finds the response over a band and its highest peak."""

import importlib
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import ModuleType
from typing import NamedTuple
from unittest import mock

import numpy as np

import symhbm as sh
from symhbm.continuation import prepare

MANY_CURVES = 1000
"""Curves of one structure that make it machine code."""
CONVERGED = 2**15
"""Samples from which on the error of sampling, below 1e-8, no longer counts."""


class Found(NamedTuple):
    """Highest peak [Hz, m] of a response that took so many accepted points."""

    points: int
    frequency: float
    amplitude: float


class MissingError(Exception):
    """A program that cannot be measured here, and why."""


def optional(module: str) -> ModuleType:
    """Import a module of the benchmarks that needs a package which may be absent."""
    try:
        return importlib.import_module(f"tests.benchmarks.{module}")
    except ImportError as error:
        raise MissingError(f"{module} skipped: {error}") from error


@contextmanager
def evaluated_by(machine_code: bool) -> Iterator[None]:
    """Context in which each structure is machine code from its first curve on, or none is."""

    def prepared(curve, count, announce):
        return machine_code and prepare(curve, MANY_CURVES, announce)

    with mock.patch("symhbm.response.curve.prepare", prepared):
        yield


def by_symhbm(
    problem: sh.HarmonicBalance,
    band: tuple[float, float],
    machine_code: bool = True,
    **options,
) -> Callable:
    """Prepare this library."""

    def run() -> Found:
        with evaluated_by(machine_code):
            result = sh.frf(problem, band, throw=True, progress=False, **options)
        height = np.atleast_1d(result.peak_amplitude.values)
        highest = int(np.nanargmax(height))
        frequency = float(np.atleast_1d(result.peak_frequency.values)[highest])
        return Found(int(result.n_points), frequency, float(height[highest]))

    return lambda: run


def by_aft(problem: sh.HarmonicBalance, band: tuple[float, float], samples: int) -> Callable:
    """Prepare the compiled loop of `tests.benchmarks.arclength`."""
    arclength = optional("arclength")
    system = optional("aft").system_of(problem, samples)

    def run() -> Found:
        response = arclength.response(system, band)
        if not response.complete:
            raise RuntimeError("the compiled loop did not reach the end of the band")
        return Found(len(response.frequency), response.peak_frequency, response.peak_amplitude)

    return lambda: run


def by_pyharm(
    problem: sh.HarmonicBalance, band: tuple[float, float], samples: int, height: float
) -> Callable:
    """Prepare pyHarm, told how high the peak is."""
    peer = optional("peer_pyharm")
    try:
        peer.analysis_of(problem, band, samples, height)
    except (KeyError, TypeError, AttributeError) as error:
        raise MissingError(f"pyHarm skipped, another interface: {error!r}") from error

    def prepare() -> Callable[[], Found]:
        analysis = peer.analysis_of(problem, band, samples, height)

        def run() -> Found:
            with warnings.catch_warnings():  # numba's hints to those who wrote it
                warnings.simplefilter("ignore")
                analysis.Solve()
            return Found(*peer.peak_of(analysis, problem, band))

        return run

    return prepare


def converged(problem: sh.HarmonicBalance, band: tuple[float, float]) -> Found:
    """The peak by the compiled loop with so many samples that their number no longer counts."""
    return by_aft(problem, band, CONVERGED)()()
