"""The microfacet term that most models are compositions of."""

from __future__ import annotations

from jaxtyping import Array, Float

from ..geometry import Geometry


def microfacet(
    ndf: Float[Array, "..."], fresnel: Float[Array, "..."], masking: Float[Array, "..."], g: Geometry
) -> Float[Array, "..."]:
    """F D G / (4 (n.l)(n.v)), in 1/sr (Hoffman 2013, eq. 12; Cook & Torrance wrote pi in place of 4)."""
    return fresnel * (ndf * (masking / (4 * g.cos_i * g.cos_o)))
