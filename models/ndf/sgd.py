"""Shifted gamma distribution (Bagher et al. 2012, eq. 11; Hoffman 2013, eq. 23-24)."""

from __future__ import annotations

from itertools import product
from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...quadrature import gauss_legendre


class SGD(eqx.Module):
    """D = exp(-x) / (x^p alpha Gamma(1 - p, alpha) pi (n.m)^4),  x = alpha + tan^2(theta_m)/alpha.

    ``alpha`` > 0 is the width (the mean square slope of the Gaussian it tends to for p = 0), any real ``p`` the shape of
    the tail. Gamma(s, x) is the upper incomplete gamma function, needed here for s = 1 - p <= 0 too. With t = m e^u,

        Gamma(s, alpha) = m^s e^(-m) I,   I = int_ln(alpha/m)^inf exp(s u - m (e^u - 1)) du,
        D = exp(m - x) (m/x)^p / (pi alpha m I (n.m)^4),

    for any m > 0. At m = max(alpha, s) the integrand peaks at u = 0 with value 1, so that nothing over- or underflows. As D
    does not depend on m, no derivative need go through it: none goes through s, which may be tiny (those of the factors are
    1/s, and cancel); alpha moves, so that x/alpha is 1 at the pole whatever alpha is.
    """

    alpha: Float[Array, ""]
    p: Float[Array, ""]

    smith_reach: ClassVar[float] = 15.0
    """See :func:`brdfit.models.masking.smith_lambda`: exp(-tan^2/alpha) ends the integral long before the horizon."""

    @staticmethod
    def shapes(half_width: float) -> list[dict[str, float]]:
        """Tails and widths crossed: alpha as D falls to half there, on a logarithmic grid of it."""
        tan2 = np.tan(half_width) ** 2
        shapes = []
        for p, scale in product((-1.0, 0.0, 0.5, 1.0, 1.5, 3.0), (0.1, 1.0, 4.0)):
            grid = np.exp(np.linspace(np.log(1e-7), np.log(30), 2000))
            fall = tan2 * scale / grid + p * np.log1p(tan2 * scale / grid**2)
            shapes.append({"alpha": float(grid[np.argmin(np.abs(fall - np.log(2)))]), "p": p})
        return shapes + [{"alpha": a, "p": p} for a, p in ((1e-4, 1.2), (1e-3, 1.0), (0.3, 8.0), (2.0, 20.0))]

    def reference(self) -> Float[Array, ""]:
        """m."""
        return jnp.where(self.alpha > 1 - self.p, self.alpha, jax.lax.stop_gradient(1 - self.p))

    def integral(self) -> Float[Array, ""]:
        """I, by 128 Gauss-Legendre nodes over the range where the integrand is above e^-45 of its peak."""
        x, weight = (jnp.asarray(a, jnp.result_type(self.alpha)) for a in gauss_legendre(128))
        s, m = 1 - self.p, self.reference()
        # Where the range is cut is no part of the answer: no derivative goes through it.
        # Guards: 45/rate has no meaning, and the wrong sign, for a rate below 0 (tests/test_ndf.py::test_normalisation).
        rate, scale = jax.lax.stop_gradient((s, m))
        end = jnp.minimum(jnp.log(_tail(scale, 45) / scale), 45 / jnp.maximum(-rate, 0.1))
        start = jnp.maximum(jnp.log(self.alpha / m), -1 - 45 / jnp.maximum(rate, 0.1))
        u = start + x * (end - start)
        return (end - start) * jnp.sum(weight * jnp.exp(s * u - m * jnp.expm1(u)))

    def __call__(self, sin2: Float[Array, "..."], cos2: Float[Array, "..."]) -> Float[Array, "..."]:
        """D in 1/sr."""
        m = self.reference()
        # Guard: towards the horizon D falls below the smallest number while x and 1/cos^4 grow beyond the largest one,
        # and 0 * inf = NaN (tests/test_ndf.py::test_sgd_at_the_horizon).
        lost = sin2 > jax.lax.stop_gradient(self.alpha * _tail(m, 1000)) * cos2
        sin2, cos2 = jnp.where(lost, 0, sin2), jnp.where(lost, 1, cos2)
        tail = sin2 / cos2 / self.alpha
        x = self.alpha + tail
        # Guard: reciprocals, because the derivative of a quotient a/b forms a db, 1e-40 here, below float32
        # (tests/test_ndf.py::test_sgd_slopes_in_single_precision).
        k = 1 / (jnp.pi * self.alpha) * (1 / (m * self.integral()))
        ratio = x / m
        # what the rounding of 1 + small leaves out, which p multiplies
        rest = jnp.where(ratio > 0.5, (((self.alpha - m) + tail) / m - (ratio - 1)) / ratio, 0)
        log_ratio = jnp.log(ratio) + jax.lax.stop_gradient(rest)
        # Guard: k may be 1e25 where exp is below float32, and its root is not
        # (tests/test_ndf.py::test_tails_in_single_precision).
        half = jnp.exp(((m - self.alpha) - tail - self.p * log_ratio) / 2)
        return jnp.where(lost, 0, k * half * half / cos2**2)


def _tail(m: Float[Array, ""], a: float) -> Float[Array, ""]:
    """A bound on where m ln(t/m) - (t - m) falls to -a: t = m + sqrt(2 a m) + a, since d - ln(1 + d) >= a/m there."""
    return m + jnp.sqrt(2 * a * m) + a
