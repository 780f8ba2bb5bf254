"""Body term that trades energy with a Schlick lobe (Ashikhmin & Shirley 2000, eq. 5)."""

from __future__ import annotations

from jaxtyping import Array, Float

from ...geometry import Geometry
from .lambert import lambert


def _rise(cosine: Float[Array, "..."]) -> Float[Array, "..."]:
    """1 - (1 - cos/2)^5 as cos times a polynomial, which does not cancel at grazing."""
    x = cosine / 2
    return x * (5 + x * (-10 + x * (10 + x * (-5 + x))))


def ashikhmin_shirley_albedo(albedo: Float[Array, "..."], specular: Float[Array, ""], g: Geometry) -> Float[Array, "..."]:
    """28/23 albedo (1 - specular)(1 - (1 - n.l/2)^5)(1 - (1 - n.v/2)^5): what a Schlick lobe leaves of a body's albedo."""
    return 28 * albedo / 23 * (1 - specular) * (_rise(g.cos_i) * _rise(g.cos_o))


def ashikhmin_shirley_body(albedo: Float[Array, ""], specular: Float[Array, ""], g: Geometry) -> Float[Array, "..."]:
    """That over pi, in 1/sr."""
    return lambert(ashikhmin_shirley_albedo(albedo, specular, g))
