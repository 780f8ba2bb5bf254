"""Functions of one polar angle on a table: computed once for each set of parameters, not once for each cell.

Smith masking is an integral for each polar angle. A table of a million cells holds a million polar angles, but the
function is smooth: it is evaluated at a few Chebyshev nodes, carried to a fine uniform grid by one small matrix, and read
off at the cells by a four-point (cubic Lagrange) stencil whose positions are computed once per table.

Error: 64 Chebyshev nodes over [0, 80 degrees] give 3e-9 relative for the exact Smith integral of the lobes in use;
the cubic stencil on 1024 intervals adds h^4/43 max|f''''|, below 1e-10 there (tests/test_polar.py measures both).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

NODES = 64
INTERVALS = 1024


@lru_cache(maxsize=8)
def _tables(max_angle: float, dtype: str) -> tuple[np.ndarray, np.ndarray]:
    """cos of the Chebyshev angles ``[NODES]`` and the matrix ``[INTERVALS + 1, NODES]`` to the uniform angles."""
    k = np.arange(NODES)
    x = np.cos(np.pi * (2 * k + 1) / (2 * NODES))
    uniform = np.linspace(-1, 1, INTERVALS + 1)
    # barycentric weights of Chebyshev points of the first kind (Berrut & Trefethen 2004, eq. 5.3)
    weight = (-1.0) ** k * np.sin(np.pi * (2 * k + 1) / (2 * NODES))
    matrix = weight / (uniform[:, None] - x)  # x is irrational: no uniform angle is a node
    matrix /= matrix.sum(1, keepdims=True)
    return np.cos((x + 1) / 2 * max_angle).astype(dtype), matrix.astype(dtype)


class PolarTables:
    """Tables of polar functions made before the cells are visited.

    A program that runs over a table block by block would make them anew in every block. Built with none, it notes the
    tables a model asks for, in ``made``; built with those, it hands them out again in the same order.
    """

    def __init__(self, made: list[Array] | None = None) -> None:
        self.replay = made is not None
        self.made: list[Array] = list(made or [])
        self._next = 0

    def get(self, make: Callable[[], Array]) -> Array:
        """The next table: made now, or as it was made before."""
        if not self.replay:
            self.made.append(make())
            return self.made[-1]
        self._next += 1
        return self.made[self._next - 1]


class PolarStencil(eqx.Module):
    """Positions of polar angles on a uniform table over [0, ``max_angle``] radians."""

    index: Int[Array, "..."]
    fraction: Float[Array, "..."]
    max_angle: float = eqx.field(static=True)

    @staticmethod
    def of(cosine: np.ndarray, max_angle: float) -> PolarStencil:
        """Stencil of angles given by their cosines, all within [0, max_angle]."""
        # Guard: the cosine of a vector normalised to rounding may be above 1 (tests/test_polar.py::test_beyond_one).
        position = np.arccos(np.clip(cosine, -1, 1)) * (INTERVALS / max_angle)
        # the stencil's four points are index-1 .. index+2, so the first and last interval lean inwards
        index = np.clip(position.astype(np.int32), 1, INTERVALS - 2)
        return PolarStencil(index, position - index, max_angle)

    @staticmethod
    def cosines(max_angle: float) -> np.ndarray:
        """Cosines of the angles over [0, ``max_angle``] radians that :meth:`tabulate` asks for, ``[NODES]``."""
        return _tables(max_angle, "float64")[0]

    def tabulate(self, function: Callable[[Array], Array]) -> Array:
        """``function(cos(theta))`` on the uniform table, ``[INTERVALS + 1]``."""
        cosines, matrix = _tables(self.max_angle, str(self.fraction.dtype))
        return jnp.asarray(matrix) @ function(jnp.asarray(cosines))

    def interpolate(self, nodes: Array) -> Array:
        """Values at the stencil's positions, its shape, from values on the uniform table."""
        t = self.fraction
        below, above = t + 1, t - 1
        beyond = t - 2
        weights = (-t * above * beyond / 6, below * above * beyond / 2, -below * t * beyond / 2, below * t * above / 6)
        return sum(w * nodes[self.index + (k - 1)] for k, w in enumerate(weights))  # type: ignore[return-value]
