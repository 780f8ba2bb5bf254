"""Beckmann: a Gaussian of slopes (Beckmann & Spizzichino 1963; Walter et al. 2007, eq. 25) with its closed Smith masking."""

from __future__ import annotations

from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

_GONE = 800.0
"""exp(-800) is 0 in double precision."""


class Beckmann(eqx.Module):
    """D = exp(-tan^2(theta_m)/alpha^2) / (pi alpha^2 (n.m)^4), ``alpha`` > 0 the rms slope times sqrt 2.

    Hoffman (2013), eq. 17. For alpha > 1/sqrt 2 the density peaks away from the normal.
    """

    alpha: Float[Array, ""]

    elementary: ClassVar[bool] = True
    """See :func:`brdfit.models.masking.smith_lambda`: its projected area costs less than a table of it."""

    def __call__(self, sin2: Float[Array, "..."], cos2: Float[Array, "..."]) -> Float[Array, "..."]:
        """D in 1/sr."""
        # Guard: towards the horizon 1/cos^4 grows beyond the largest number while exp is 0, and 0 * inf = NaN
        # (tests/test_ndf.py::test_finite_at_both_ends).
        lost = sin2 > _GONE * jax.lax.stop_gradient(self.alpha) ** 2 * cos2
        sin2, cos2 = jnp.where(lost, 0, sin2), jnp.where(lost, 1, cos2)
        half = jnp.exp(-sin2 / cos2 / (2 * self.alpha**2))  # the peak may be 1e8 where exp is below float32
        return jnp.where(lost, 0, half / (jnp.pi * self.alpha**2 * cos2**2) * half)

    def averted_area(self, cosine: Float[Array, "..."]) -> Float[Array, "..."]:
        """n.v Lambda(v) = (alpha sin exp(-a^2)/sqrt(pi) - cos erfc(a))/2, a = cos/(alpha sin) (Heitz 2014, eq. 66)."""
        # Guard: 1/0 at normal incidence, and the slope of the sine (tests/test_microfacet_models.py::test_own_masking).
        sin2 = (1 - cosine) * (1 + cosine)
        unseen = cosine * cosine > _GONE * jax.lax.stop_gradient(self.alpha) ** 2 * sin2
        across = self.alpha * jnp.sqrt(jnp.where(unseen, 1, sin2))
        a = jnp.where(unseen, 1, cosine) / across
        area = (across * jnp.exp(-a * a) / jnp.sqrt(jnp.pi) - cosine * jax.scipy.special.erfc(a)) / 2
        return jnp.where(unseen, 0, area)
