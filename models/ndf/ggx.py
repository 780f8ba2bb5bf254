"""GGX: the Trowbridge-Reitz distribution with its closed Smith masking (Walter et al. 2007, eq. 33 and 34)."""

from __future__ import annotations

from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float


class GGX(eqx.Module):
    """D = alpha^2 / (pi ((n.m)^2 (alpha^2 - 1) + 1)^2), ``alpha`` > 0 the width (Hoffman 2013, eq. 18).

    The base is written sin^2 + alpha^2 cos^2, which does not cancel. :class:`GTR` with gamma = 2 is the same distribution.
    """

    alpha: Float[Array, ""]

    elementary: ClassVar[bool] = True
    """See :func:`brdfit.models.masking.smith_lambda`: its projected area costs less than a table of it."""

    def __call__(self, sin2: Float[Array, "..."], cos2: Float[Array, "..."]) -> Float[Array, "..."]:
        """D in 1/sr."""
        return (self.alpha / (sin2 + self.alpha**2 * cos2)) ** 2 / jnp.pi

    def averted_area(self, cosine: Float[Array, "..."]) -> Float[Array, "..."]:
        """n.v Lambda(v) = (sqrt(cos^2 + alpha^2 sin^2) - cos)/2 (Heitz 2014, eq. 72), as a quotient that does not cancel."""
        a2s2 = self.alpha**2 * ((1 - cosine) * (1 + cosine))
        return a2s2 / (2 * (jnp.sqrt(cosine * cosine + a2s2) + cosine))
