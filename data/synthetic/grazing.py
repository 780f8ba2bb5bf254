"""Functions of a polar angle on a table that reaches the horizon, to nearly the last digit.

Smith's integral takes 64 nodes a direction: 10 seconds for a whole table of ``sgd``. Unlike :mod:`brdfit.polar`, which
serves fits up to 80 degrees, a synthetic table has cells up to 90, where masking falls off within the width of the lobe,
a few milliradians for a mirror. With x = 90 degrees - theta it is smooth in ln x at every width: it is tabulated at 4096
points of ln x from 1e-9 to 90 degrees and read off by 8-point Lagrange interpolation. At a step h = 0.0052 the error
is 1.1e-3 h^8 max|f^(8)|, below 1e-14 for the Gaussian exp(-x^2/s^2), whose 8th derivative in ln x is 1.4e6 at most
(tests/test_synthetic.py::test_grazing_table measures it against direct evaluation).
"""

from __future__ import annotations

from collections.abc import Callable
from math import factorial

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int
from numpy.typing import NDArray

POINTS = 4096
LOWEST = 1e-9
"""Smallest angle to the horizon, in radians."""

_START = np.log(LOWEST)
_STEP = (np.log(np.pi / 2) - _START) / (POINTS - 1)
_OFFSETS = range(-3, 5)


class GrazingStencil(eqx.Module):
    """Positions of polar angles in the table; takes the place of a :class:`brdfit.polar.PolarStencil`."""

    index: Int[Array, "..."]
    fraction: Float[Array, "..."]

    @staticmethod
    def of(cosine: NDArray[np.float64]) -> GrazingStencil:
        """Stencil of angles given by their cosines, all in [LOWEST, 1]."""
        position = (np.log(np.arcsin(np.clip(cosine, LOWEST, 1))) - _START) / _STEP
        # the stencil's eight points are index-3 .. index+4, so it leans inwards at both ends
        index = np.clip(position.astype(np.int32), 3, POINTS - 5)
        return GrazingStencil(jnp.asarray(index), jnp.asarray(position - index))

    def tabulate(self, function: Callable[[Array], Array]) -> Array:
        """``function(cos(theta))`` at the points of the table."""
        return function(jnp.asarray(np.sin(np.exp(_START + _STEP * np.arange(POINTS)))))

    def interpolate(self, nodes: Array) -> Array:
        """Values at the stencil's positions, its shape, from values at the points of the table."""
        below = [self.fraction - k for k in _OFFSETS]
        total = jnp.zeros_like(self.fraction)
        for j, offset in enumerate(_OFFSETS):
            others = below[:j] + below[j + 1 :]
            weight = (-1) ** (7 - j) / (factorial(j) * factorial(7 - j))
            product = others[0]
            for factor in others[1:]:
                product = product * factor
            total = total + weight * product * nodes[self.index + offset]
        return total
