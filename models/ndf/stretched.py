"""Anisotropic distributions: isotropic ones with their slopes stretched."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...geometry import Geometry


class Stretched(eqx.Module):
    """An isotropic distribution of width sqrt(alpha_x alpha_y) whose slopes are stretched by sqrt(alpha_x/alpha_y) along the
    tangent and by its inverse along the bitangent (Heitz 2014, section 5.3).

    With q^2 = m_x^2 alpha_y/alpha_x + m_y^2 alpha_x/alpha_y + m_z^2, D(m) = D_round(m_z/q)/q^4, and n.v Lambda(v) is that of
    the round one at the stretched direction. Of GGX it makes Burley's (2012, eq. 13) anisotropic GGX.
    """

    round: Any
    """Distribution as in :mod:`brdfit.models.ndf`."""
    alpha_x: Float[Array, ""]
    alpha_y: Float[Array, ""]

    def density(self, g: Geometry) -> Float[Array, "..."]:
        """D of the half vector, in 1/sr; raises ValueError where its azimuth is not known."""
        x2, y2 = g.tangential()
        ratio = self.alpha_x / self.alpha_y
        across = x2 / ratio + y2 * ratio
        q2 = across + g.cos2_h
        density: Float[Array, "..."] = self.round(across / q2, g.cos2_h / q2) / q2**2
        return density

    def stretched_cosine(self, w: Float[Array, "... 3"]) -> Float[Array, "..."]:
        """n.w/|w| of a direction as the round distribution sees it."""
        ratio = self.alpha_x / self.alpha_y
        return w[..., 2] / jnp.sqrt(w[..., 0] ** 2 * ratio + w[..., 1] ** 2 / ratio + w[..., 2] ** 2)
