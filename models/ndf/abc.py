"""ABC distribution (Church & Takacs; Low et al. 2012, eq. 7; Hoffman 2013, eq. 19-22)."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...quadrature import gauss_legendre


class ABC(eqx.Module):
    """D = k / (1 + b (1 - n.m))^c, with ``b`` > 0 the inverse width and ``c`` >= 0 the fall-off.

    The normaliser 1/k = 2 pi int_0^1 (1 - s) (1 + b s)^-c ds has a closed form (eq. 20) with removable singularities at
    c = 1 and c = 2 that loses all digits as b -> 0 and for large b^c. It is integrated instead, in w = ln(1 + b s), by
    64 Gauss-Legendre nodes; for c > 1 the range ends where the integrand has fallen below 1e-17 of its peak.
    """

    b: Float[Array, ""]
    c: Float[Array, ""]

    def normalisation(self) -> Float[Array, ""]:
        """k, in 1/sr."""
        x, weight = (jnp.asarray(a, jnp.result_type(self.b)) for a in gauss_legendre(64))
        full = jnp.log1p(self.b)
        # Guard: 40/0 at c = 1, and no end below it (tests/test_models.py::test_value_and_derivative).
        decay = jnp.maximum(self.c - 1, 1e-3)
        length = jnp.minimum(full, 40 / decay)
        w = x * length
        s = jnp.expm1(w) / self.b
        return 1 / (2 * jnp.pi / self.b * length * jnp.sum(weight * (1 - s) * jnp.exp((1 - self.c) * w)))

    def __call__(self, sin2: Float[Array, "..."], cos2: Float[Array, "..."]) -> Float[Array, "..."]:
        """D in 1/sr."""
        # Guard: the slope of the root is infinite on the horizon, where Smith's integral ends at normal incidence; its
        # second power of 3/2 must fit into float32 (tests/test_masking.py::test_normal_incidence).
        cosine = jnp.sqrt(jnp.maximum(cos2, float(np.finfo(np.dtype(jnp.result_type(cos2))).tiny) ** 0.5))
        vers = sin2 / (1 + cosine)
        return self.normalisation() * jnp.exp(-self.c * jnp.log1p(self.b * vers))
