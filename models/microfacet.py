"""The microfacet term that most models are compositions of."""

from __future__ import annotations

from jaxtyping import Array, Float


def microfacet(
    ndf: Float[Array, "..."], fresnel: Float[Array, "..."], visibility: Float[Array, "..."]
) -> Float[Array, "..."]:
    """F D V, V = G / (4 (n.l)(n.v)), in 1/sr (Hoffman 2013, eq. 12; Cook & Torrance wrote pi in place of 4).

    Masking comes with its divisor, because towards grazing G falls as fast as it: their quotient has an ordinary slope,
    which the difference of their slopes loses.
    """
    return fresnel * (ndf * visibility)
