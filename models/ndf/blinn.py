"""Blinn's power of the cosine as a distribution of microfacets (Blinn 1977; Hoffman 2013, eq. 16)."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .power_cosine import log_cosine


class Blinn(eqx.Module):
    """D = (exponent + 2)/(2 pi) (n.m)^exponent, ``exponent`` >= 0; 0 is a uniform distribution.

    :func:`power_cosine` is the same power normalised as a density of half vectors, (exponent + 1)/(2 pi).
    """

    exponent: Float[Array, ""]

    def __call__(self, sin2: Float[Array, "..."], cos2: Float[Array, "..."]) -> Float[Array, "..."]:
        """D in 1/sr."""
        # Guard: 0 ln 0 on the horizon (tests/test_ndf.py::test_finite_at_both_ends).
        cos2 = jnp.maximum(cos2, float(np.finfo(np.dtype(jnp.result_type(cos2))).tiny) ** 0.5)
        return (self.exponent + 2) / (2 * jnp.pi) * jnp.exp(self.exponent * log_cosine(sin2, cos2))
