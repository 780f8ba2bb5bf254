"""Powers of the cosine, normalised as half-vector densities (Ashikhmin & Shirley 2000, eq. 4 and 6)."""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...special import log1p_series


def log_cosine(sin2: Float[Array, "..."], cos2: Float[Array, "..."]) -> Float[Array, "..."]:
    """ln(cos) as ln(1 - sin^2)/2 near the pole and ln(cos^2)/2 near the horizon, by one logarithm.

    What the rounding of 1 - sin^2 leaves out is added to it; its derivative is 0.
    """
    near_pole = sin2 < 0.5
    square = jnp.where(near_pole, 1 - sin2, cos2)
    rest = jax.lax.stop_gradient(jnp.where(near_pole, (1 - square - sin2) / square, 0))
    return (jnp.log(square) + rest) / 2


def log_cosine_ratio(sin2: Float[Array, "..."], cos2: Float[Array, "..."]) -> Float[Array, "..."]:
    """ln(cos)/sin^2, -1/2 at the pole."""
    near_pole = sin2 < 0.1
    # Guard: 0/0 at the pole (tests/test_ndf.py::test_power_cosine_anisotropic_at_the_pole).
    return jnp.where(near_pole, -log1p_series(-sin2) / 2, log_cosine(sin2, cos2) / jnp.where(near_pole, 1, sin2))


def power_cosine(sin2: Float[Array, "..."], cos2: Float[Array, "..."], exponent: Float[Array, ""]) -> Float[Array, "..."]:
    """(e + 1)/(2 pi) (n.h)^e, in 1/sr: integrates to 1 over the hemisphere of h."""
    return (exponent + 1) / (2 * jnp.pi) * jnp.exp(exponent * log_cosine(sin2, cos2))


def power_cosine_anisotropic(
    x2: Float[Array, "..."], y2: Float[Array, "..."], cos2: Float[Array, "..."], ex: Float[Array, ""], ey: Float[Array, ""]
) -> Float[Array, "..."]:
    """sqrt((ex+1)(ey+1))/(2 pi) (n.h)^((ex x^2 + ey y^2)/(x^2 + y^2)).

    (n.h)^(q/sin^2) = exp(q ln(cos)/sin^2): in this order the azimuth, undefined at the pole, is never formed.
    """
    q = ex * x2 + ey * y2
    return jnp.sqrt((ex + 1) * (ey + 1)) / (2 * jnp.pi) * jnp.exp(q * log_cosine_ratio(x2 + y2, cos2))
