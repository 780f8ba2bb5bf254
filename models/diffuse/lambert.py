"""Lambert's law."""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array, Float


def lambert(albedo: Float[Array, ""]) -> Float[Array, ""]:
    """albedo/pi, in 1/sr (Lambert 1760)."""
    return albedo / jnp.pi
