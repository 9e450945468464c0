"""Points of the unit cube, random or evenly spread, and Gaussian copulas that correlate them.

Values are arrays ``(n_samples, n)`` by parameter, with ``n`` blades or contacts.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import circulant
from scipy.special import ndtr, ndtri
from scipy.stats import qmc

from symhbm.numerics import FloatArray, check

SAMPLINGS = ("random", "sobol", "latin_hypercube")

_SOBOL_BLOCK = 2**14
_SOBOL_STEP = 2.0**-30
_OPEN = 2.0**-54, 1 - 2.0**-53
"""Smallest and largest share: quantiles of 0 and 1 would be infinite."""
_SHORTEST = 1e-300
"""Correlation length that stands for 0, so that no quotient overflows."""
_ROUND_OFF = 1e-10
"""Share of its size by which round-off may make a zero eigenvalue of a correlation negative."""


def unit_samples(
    sampling: str, seed: int, n_samples: int, sizes: Mapping[str, int], streams: Mapping[str, int]
) -> dict[str, FloatArray]:
    """Uniform shares between 0 and 1, both excluded, of the parameters of ``sizes``.

    ``streams`` gives the size of every drawable parameter in a fixed order: the position of a name
    is the number of its random stream, or that of its dimensions of the Sobol sequence.
    """
    if check.one_of("sampling", sampling, SAMPLINGS) == "sobol":
        return _sobol(seed, n_samples, sizes, streams)
    shares = {}
    for name, size in sizes.items():
        stream = np.random.SeedSequence([seed, list(streams).index(name)])
        rng = np.random.Generator(np.random.Philox(stream))
        if sampling == "random":
            shares[name] = rng.random((n_samples, size))
        else:
            shares[name] = qmc.LatinHypercube(size, rng=rng).random(n_samples)
    return {name: np.clip(share, *_OPEN) for name, share in shares.items()}


def _sobol(
    seed: int, n_samples: int, sizes: Mapping[str, int], streams: Mapping[str, int]
) -> dict[str, FloatArray]:
    widths = list(streams.values())
    ends = np.cumsum(widths)
    if ends[-1] > qmc.Sobol.MAXDIM:
        raise ValueError(
            f"sampling='sobol': expected at most {qmc.Sobol.MAXDIM} values of all parameters "
            f"together, got {ends[-1]}"
        )
    starts = dict(zip(streams, ends - widths, strict=True))
    # Powers of 2: the sequence is balanced over those alone.
    total = 2 ** (n_samples - 1).bit_length()
    block = min(total, _SOBOL_BLOCK)
    engine = qmc.Sobol(int(ends[-1]), rng=np.random.default_rng(seed))
    shares = {name: np.empty((total, size)) for name, size in sizes.items()}
    for start in range(0, total, block):
        points = engine.random(block) + _SOBOL_STEP / 2
        for name, size in sizes.items():
            shares[name][start : start + block] = points[:, starts[name] : starts[name] + size]
    return {name: share[:n_samples] for name, share in shares.items()}


@dataclass(frozen=True)
class Copula:
    """Gaussian copula of parameters with values per blade or contact, from roots of correlations.

    ``neighbours`` are those between blades or contacts by parameter, ``parameters`` that between
    the parameters ``together``.
    """

    neighbours: dict[str, FloatArray]
    together: list[str]
    parameters: FloatArray

    @classmethod
    def of(cls, sizes: Mapping[str, int], correlation: Any, between: Any) -> "Copula":
        """The copula of parameters with ``sizes`` values.

        ``correlation`` between neighbours is a correlation length, a matrix, or either by
        parameter; ``between`` are correlations of pairs of parameters. Raises TypeError, ValueError
        and KeyError if they are no correlations, or fit no parameter.
        """
        given: Any = {} if correlation is None else correlation
        of_all: dict[str, Any] = dict.fromkeys(sizes, given)
        by_name = given if isinstance(given, Mapping) else of_all
        for name in by_name:
            check.known(name, sizes, "parameter that is drawn")
        neighbours = {
            name: _root(f"correlation of {name}", _matrix(name, value, sizes[name]))
            for name, value in by_name.items()
        }
        together, matrix = _between(sizes, between)
        for pair, value in (between or {}).items():
            one, other = (neighbours.get(name, np.eye(sizes[name])) for name in pair)
            held = value * np.sum(one * other, axis=1)
            if not np.allclose(held, value, rtol=1e-9, atol=1e-12):
                raise ValueError(
                    f"between[{pair}]={value:g}: expected the same correlation along the ring of "
                    f"both parameters; theirs differ, which would leave {held.min():.3g} to "
                    f"{held.max():.3g} between them"
                )
        return cls(neighbours, together, _root("between", matrix))

    def couple(self, shares: dict[str, FloatArray]) -> dict[str, FloatArray]:
        """Correlated shares, each still uniform, from independent ones."""
        result = dict(shares)
        if self.together:
            scores = _mixed(self.parameters, [ndtri(shares[name]) for name in self.together])
            result |= {
                name: np.clip(ndtr(score), *_OPEN)
                for name, score in zip(self.together, scores, strict=True)
            }
        for name, root in self.neighbours.items():
            columns = list(ndtri(result[name]).T)
            result[name] = np.clip(ndtr(np.stack(_mixed(root, columns), axis=1)), *_OPEN)
        return result


def _mixed(root: FloatArray, scores: Sequence[FloatArray]) -> list[FloatArray]:
    """Each row of ``root`` times the scores, summed in the same order for any number of samples."""
    mixed = []
    for row in root:
        total = np.zeros_like(scores[0])
        for weight, score in zip(row, scores, strict=True):
            total += weight * score
        mixed.append(total)
    return mixed


def _matrix(name: str, value: ArrayLike, size: int) -> FloatArray:
    array = check.array("correlation", value)
    if array.ndim == 0:
        length = check.scalar("correlation", value, "non-negative")
        gap = np.minimum(np.arange(size), size - np.arange(size))
        return circulant(np.exp(-gap / max(length, _SHORTEST)))
    if array.shape != (size, size):
        raise ValueError(
            f"correlation={check.shown(value)}: expected a correlation length or a matrix of shape "
            f"{(size, size)} for {name}, got shape {array.shape}"
        )
    return array


def _between(sizes: Mapping[str, int], between: Any) -> tuple[list[str], FloatArray]:
    if between is None:
        return [], np.eye(0)
    check.instance("between", between, Mapping, "correlations by pairs of parameters")
    for pair in between:
        if not isinstance(pair, tuple) or len(pair) != 2 or pair[0] == pair[1]:
            raise ValueError(f"between: expected pairs of two parameters, got {check.shown(pair)}")
        for name in pair:
            check.known(name, sizes, "parameter that is drawn")
        if sizes[pair[0]] != sizes[pair[1]]:
            raise ValueError(
                f"between: expected parameters with as many values, {pair[0]} has "
                f"{sizes[pair[0]]}, {pair[1]} has {sizes[pair[1]]}"
            )
    names = [name for name in sizes if any(name in pair for pair in between)]
    matrix = np.eye(len(names))
    for pair, value in between.items():
        i, j = map(names.index, pair)
        if matrix[i, j] != 0:
            raise ValueError(f"between: expected each pair once, got {pair} twice")
        matrix[i, j] = matrix[j, i] = check.scalar(f"between[{pair}]", value)
    return names, matrix


def _root(label: str, matrix: FloatArray) -> FloatArray:
    """Symmetric root of a correlation matrix, which need not have full rank."""
    size = len(matrix)
    if not np.array_equal(matrix, matrix.T) or np.any(np.diag(matrix) != 1):
        raise ValueError(f"{label}: expected a symmetric matrix with ones on its diagonal")
    if size == 0 or np.array_equal(matrix, np.eye(size)):
        return matrix
    values, vectors = np.linalg.eigh(matrix)
    if values[0] < -_ROUND_OFF * size:
        raise ValueError(
            f"{label}: expected a positive semidefinite matrix, its lowest eigenvalue is "
            f"{values[0]:.3g}"
        )
    return (vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T
