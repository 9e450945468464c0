"""The law ``Penalty3D`` of pyHarm (package ``pyHarm-os``) by itself: its force and Jacobian."""

import os
import tempfile
from collections.abc import Callable

import numpy as np

# It keeps a file of its state, by default in the working directory.
os.environ.setdefault(
    "PYHARM_CONTEXT_FILE", os.path.join(tempfile.gettempdir(), "pyharm_context.json")
)
import jax
from pyHarm.Elements.NodeToNodeElements.Penalty3D import evalResidual_jax, jaxf

from symhbm.numerics import FourierBasis

jax.config.update("jax_enable_x64", True)


def force_of(basis: FourierBasis, values: dict[str, float], samples: int) -> Callable:
    """From a motion (2 K) to force coefficients (2 K) and Jacobian, one contact at a time.

    ``values``: ``contact_stiffness``, ``normal_stiffness``, ``friction_coefficient``, ``preload``
    and ``gap``. The second tangential direction of the law rests. Behind a gap its normal
    displacement closes where it is positive, as here, and under a preload it opens.
    """
    size = basis.n_components
    functions = basis.values(2 * np.pi * np.arange(samples) / samples)
    to_time, to_harmonics = functions.T, functions * basis.norm * (2 * np.pi / samples)
    directions = np.eye(3 * size).reshape(3, size, 3 * size)
    names = "friction_coefficient", "preload", "gap", "normal_stiffness", "contact_stiffness"
    given = [values[name] for name in names]
    arguments = 0.0, directions, np.eye(3 * size), np.zeros((3 * size, 3 * size)), *given
    at = *arguments, to_time, to_harmonics
    # It has the normal direction first.
    order = np.r_[size : 2 * size, :size]
    sign = np.repeat([1.0, -1.0 if values["preload"] else 1.0], size)

    def evaluate(motion: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        x = np.zeros(3 * size)
        x[order] = sign * motion
        force, slope = np.asarray(evalResidual_jax(x, *at)), np.asarray(jaxf(x, *at))
        return sign * force[order], np.outer(sign, sign) * slope[np.ix_(order, order)]

    return evaluate
