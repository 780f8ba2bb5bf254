"""Beckmann: a Gaussian of slopes with its own Smith masking."""

from __future__ import annotations

from .factory import named

Beckmann = named(
    "beckmann",
    ("beckmann", "smith", "schlick", "lambert"),
    """f = diffuse/pi + F_schlick(specular, c_d) D_beckmann G / (4 n.l n.v), G height-correlated Smith of D_beckmann in
    closed form (Walter et al. 2007, eq. 25; Heitz 2014, eq. 66 and 99).

    Reciprocal. The lobe conserves energy for specular <= 1; the sum need not, as the body term ignores the lobe. Known
    failure: measured highlights have tails that a Gaussian has not; the body term then takes them.
    """,
)
