"""The Gaussian of angles of Torrance & Sparrow (1967) and Blinn (1977); Schwenk (2011), eq. 36."""

from __future__ import annotations

import math

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...quadrature import gauss_legendre

_SERIES = tuple(2.0 ** (2 * n - 1) / (n * n * math.comb(2 * n, n)) for n in range(1, 15))
"""arcsin(s)^2 = sum of these times s^(2 n); at s^2 <= 0.1 the first one left out is below 1e-16 of the sum."""


def angle2(sin2: Float[Array, "..."], cos2: Float[Array, "..."]) -> Float[Array, "..."]:
    """theta^2 of the squared sine and cosine of theta in [0, pi/2], with every derivative finite at both ends."""
    near_pole = sin2 < 0.1
    low = jnp.where(near_pole, sin2, 0)
    series = jnp.full_like(low, _SERIES[-1])
    for c in reversed(_SERIES[:-1]):
        series = series * low + c
    # Guard: the slope of the root is infinite on the horizon, and at the pole (tests/test_ndf.py::test_finite_at_both_ends).
    cosine = jnp.sqrt(jnp.maximum(cos2, float(np.finfo(np.dtype(jnp.result_type(cos2))).tiny) ** 0.5))
    theta = jnp.arctan2(jnp.sqrt(jnp.where(near_pole, 0.5, sin2)), cosine)
    return jnp.where(near_pole, series * low, theta * theta)


class GaussianAngles(eqx.Module):
    """D = k exp(-theta_m^2/alpha^2), ``alpha`` > 0 in radians.

    The sources leave k free; here D is normalised, 1/k = pi int_0^(pi/2) exp(-theta^2/alpha^2) sin(2 theta) dtheta, by 64
    Gauss-Legendre nodes over the range where the exponential is above e^-40.
    """

    alpha: Float[Array, ""]

    def normalisation(self) -> Float[Array, ""]:
        """k, in 1/sr."""
        x, weight = (jnp.asarray(a, jnp.result_type(self.alpha)) for a in gauss_legendre(64))
        u = x * jnp.minimum(40.0**0.5, jnp.pi / 2 / self.alpha)  # theta/alpha
        step = jnp.minimum(40.0**0.5 * self.alpha, jnp.pi / 2)
        return 1 / (jnp.pi * step * jnp.sum(weight * jnp.exp(-u * u) * jnp.sin(2 * self.alpha * u)))

    def __call__(self, sin2: Float[Array, "..."], cos2: Float[Array, "..."]) -> Float[Array, "..."]:
        """D in 1/sr."""
        return self.normalisation() * jnp.exp(-angle2(sin2, cos2) / self.alpha**2)
