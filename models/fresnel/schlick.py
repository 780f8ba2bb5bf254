"""Schlick's approximation and its relatives."""

from __future__ import annotations

from jaxtyping import Array, Float

from ...geometry import Geometry


def schlick(f0: Float[Array, ""], g: Geometry) -> Float[Array, "..."]:
    """F0 + (1 - F0)(1 - c_d)^5 (Schlick 1994, eq. 15)."""
    return f0 + (1 - f0) * g.vers_d**5


def sgd_fresnel(f0: Float[Array, ""], f1: Float[Array, ""], g: Geometry) -> Float[Array, "..."]:
    """f0 + (1 - f0)(1 - c_d)^5 - f1 c_d (Bagher et al. 2012, eq. 12). Falls below 0 where f1 c_d exceeds the rest."""
    return f0 + (1 - f0) * g.vers_d**5 - f1 * g.cos_d
