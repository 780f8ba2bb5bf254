"""GGX: Walter's microfacets with height-correlated masking."""

from __future__ import annotations

from .factory import named

GGX = named(
    "ggx",
    ("ggx", "smith", "schlick", "lambert"),
    """f = diffuse/pi + F_schlick(specular, c_d) D_ggx G / (4 n.l n.v), G height-correlated Smith of D_ggx in closed form
    (Walter et al. 2007, eq. 33 and 34; Heitz 2014, eq. 99). It is ``gtr`` with gamma = 2.

    Reciprocal. The lobe conserves energy for specular <= 1 and loses some for large alpha (light that would be reflected
    again); the sum need not: the body term ignores the lobe. Known failure: for many materials the peak is narrower and
    the tail longer than one width allows.
    """,
)
