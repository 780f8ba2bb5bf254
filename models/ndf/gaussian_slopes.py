"""The Gaussian of slopes that Ward's model is made of (Ward 1992, eq. 4 and 5)."""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array, Float


def gaussian(tan2: Float[Array, "..."], alpha: Float[Array, ""]) -> Float[Array, "..."]:
    """exp(-tan^2(theta_h)/alpha^2) / (pi alpha^2)."""
    return jnp.exp(-tan2 / alpha**2) / (jnp.pi * alpha**2)


def anisotropic_gaussian(
    slope_x2: Float[Array, "..."], slope_y2: Float[Array, "..."], ax: Float[Array, ""], ay: Float[Array, ""]
) -> Float[Array, "..."]:
    """exp(-tan^2 (cos^2 phi/ax^2 + sin^2 phi/ay^2)) / (pi ax ay), of tan^2 cos^2 phi and tan^2 sin^2 phi: the squared slopes
    of h, so that no azimuth is needed.
    """
    return jnp.exp(-(slope_x2 / ax**2 + slope_y2 / ay**2)) / (jnp.pi * ax * ay)
