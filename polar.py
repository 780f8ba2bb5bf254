"""Functions of one polar angle on a table: computed once for each set of parameters, not once for each cell.

Smith masking is an integral for each polar angle. A table of a million cells holds a million polar angles, but the
function is smooth: it is evaluated at a few nodes, carried to a fine grid, and read off at the cells by a four-point
(cubic Lagrange) stencil whose positions are computed once per table.

Masking falls off towards the horizon within the width of the lobe, a milliradian for a mirror. In the distance to the
horizon, here x = cos(theta)/(1 + sin(theta)), half of it in radians or nearly so, it is smooth in ln x at every width. Grid
and nodes are even in t, x = x_0 + w sinh(t): x_0 is where the table ends, 1e-5 from the horizon at the latest (closer, a
function keeps the value that it has there), and w is where ln x gives way to x.

Tables for fits are made anew in every step, from 64 Chebyshev nodes: 3e-9 relative error of G1 up to 80 degrees, 1e-8 up to
85, 5e-8 up to 89, 2e-7 up to 89.9 and 2e-6 up to 89.999. A table for pictures is made once (``fine``), directly at 4096
angles: 5e-9 up to 89.999 degrees (tests/test_polar.py measures all).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

NODES = 64
INTERVALS = {False: 1024, True: 4096}
NARROWEST = {False: 5e-5, True: 5e-6}
"""Smallest w by ``fine``: 64 nodes do not follow more of ln x."""
CLOSEST = 5e-6
"""Smallest x: closer, Smith's integral itself loses its digits."""


def _distances(max_angle: float, fine: bool) -> tuple[float, float, float]:
    """x_0, w, and the end of t, at normal incidence."""
    end = max(float(np.tan((np.pi / 2 - max_angle) / 2)), CLOSEST)
    width = max(end, NARROWEST[fine])
    return end, width, float(np.arcsinh((1 - end) / width))


@lru_cache(maxsize=8)
def _tables(max_angle: float, fine: bool, dtype: str) -> tuple[np.ndarray, np.ndarray | None]:
    """cos of the nodes, and the matrix from them to the angles of the table; None where they are those angles."""
    end, width, top = _distances(max_angle, fine)

    def cosines(place: np.ndarray) -> np.ndarray:
        """From [-1, 1] along t."""
        x = end + width * np.sinh((place + 1) / 2 * top)
        return np.asarray(2 * x / (1 + x * x), dtype)

    uniform = np.linspace(-1, 1, INTERVALS[fine] + 1)
    if fine:
        return cosines(uniform), None
    k = np.arange(NODES)
    x = np.cos(np.pi * (2 * k + 1) / (2 * NODES))
    # barycentric weights of Chebyshev points of the first kind (Berrut & Trefethen 2004, eq. 5.3)
    weight = (-1.0) ** k * np.sin(np.pi * (2 * k + 1) / (2 * NODES))
    matrix = weight / (uniform[:, None] - x)  # x is irrational: no angle of the table is a node
    matrix /= matrix.sum(1, keepdims=True)
    return cosines(x), matrix.astype(dtype)


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
    """Positions of polar angles on a table over [0, ``max_angle``] radians."""

    index: Int[Array, "..."]
    fraction: Float[Array, "..."]
    max_angle: float = eqx.field(static=True)
    fine: bool = eqx.field(static=True, default=False)

    @staticmethod
    def of(cosine: np.ndarray, max_angle: float) -> PolarStencil:
        """Stencil of angles given by their cosines, all within [0, max_angle]."""
        # Guard: the cosine of a vector normalised to rounding may be above 1 (tests/test_polar.py::test_beyond_one).
        cosine = np.clip(cosine, 0, 1)
        return PolarStencil(*_positions(cosine, np.sqrt((1 - cosine) * (1 + cosine)), max_angle, False, np), max_angle)

    @staticmethod
    def to_horizon(cosine: Array, sine: Array) -> PolarStencil:
        """Stencil on the fine table up to the horizon of angles given by both, within a program.

        From the sine, too: made of the cosine, its slope is infinite at normal incidence.
        """
        limit = float(np.pi / 2)
        return PolarStencil(*_positions(cosine, sine, limit, True, jnp), limit, True)

    @staticmethod
    def cosines(max_angle: float) -> np.ndarray:
        """Cosines of the angles over [0, ``max_angle``] radians that :meth:`tabulate` asks for, ``[NODES]``."""
        return _tables(max_angle, False, "float64")[0]

    def tabulate(self, function: Callable[[Array], Array]) -> Array:
        """``function(cos(theta))`` at the angles of the table."""
        cosines, matrix = _tables(self.max_angle, self.fine, str(self.fraction.dtype))
        values = function(jnp.asarray(cosines))
        return values if matrix is None else jnp.asarray(matrix) @ values

    def interpolate(self, nodes: Array) -> Array:
        """Values at the stencil's positions, its shape, from values at the angles of the table."""
        t = self.fraction
        below, above = t + 1, t - 1
        beyond = t - 2
        weights = (-t * above * beyond / 6, below * above * beyond / 2, -below * t * beyond / 2, below * t * above / 6)
        return sum(w * nodes[self.index + (k - 1)] for k, w in enumerate(weights))  # type: ignore[return-value]


def _positions(cosine: Any, sine: Any, max_angle: float, fine: bool, xp: Any) -> tuple[Any, Any]:
    """Index and fraction on the table of angles given by cosine and sine, with NumPy or its like in JAX."""
    end, width, top = _distances(max_angle, fine)
    y = xp.maximum(cosine / (1 + sine) - end, 0) / width
    position = xp.log(y + xp.sqrt(1 + y * y)) * (INTERVALS[fine] / top)  # arsinh: y is not negative
    # the stencil's four points are index-1 .. index+2, so the first and last interval lean inwards
    index = xp.clip(position.astype(xp.int32), 1, INTERVALS[fine] - 2)
    return index, position - index
