"""Powers of the cosine, normalised as half-vector densities (Ashikhmin & Shirley 2000, eq. 4 and 6)."""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array, Float

from ...special import log1p_ratio


def log_cosine_ratio(sin2: Float[Array, "..."], cos2: Float[Array, "..."]) -> Float[Array, "..."]:
    """ln(cos)/sin^2: ln(1 - sin^2)/(2 sin^2) near the pole, where it is -1/2, and ln(cos^2)/(2 sin^2) near the horizon."""
    high = sin2 < 0.5
    # Guards: ln(1 - sin^2) is -inf where sin^2 rounds to 1, and ln(cos^2)/sin^2 is 0/0 at the pole, with NaN derivatives
    # in the branch that is not used (tests/test_ndf.py::test_power_cosine_at_both_ends).
    near_pole = log1p_ratio(-jnp.where(high, sin2, 0))
    near_horizon = jnp.log(cos2) / jnp.where(high, 1, sin2)
    return jnp.where(high, -near_pole, near_horizon) / 2


def power_cosine(sin2: Float[Array, "..."], cos2: Float[Array, "..."], exponent: Float[Array, ""]) -> Float[Array, "..."]:
    """(e + 1)/(2 pi) (n.h)^e, in 1/sr: integrates to 1 over the hemisphere of h."""
    return (exponent + 1) / (2 * jnp.pi) * jnp.exp(exponent * sin2 * log_cosine_ratio(sin2, cos2))


def power_cosine_anisotropic(
    x2: Float[Array, "..."], y2: Float[Array, "..."], cos2: Float[Array, "..."], ex: Float[Array, ""], ey: Float[Array, ""]
) -> Float[Array, "..."]:
    """sqrt((ex+1)(ey+1))/(2 pi) (n.h)^((ex x^2 + ey y^2)/(x^2 + y^2)).

    (n.h)^(q/sin^2) = exp(q ln(cos)/sin^2): in this order the azimuth, undefined at the pole, is never formed.
    """
    q = ex * x2 + ey * y2
    return jnp.sqrt((ex + 1) * (ey + 1)) / (2 * jnp.pi) * jnp.exp(q * log_cosine_ratio(x2 + y2, cos2))
