"""Cook-Torrance: facets in V-shaped grooves, with three distributions."""

from __future__ import annotations

from .factory import named

_COMMON = """

    Divisor 4 in place of the pi of Cook & Torrance (1982), eq. 2; Schlick's Fresnel in place of theirs. The survey's prints
    of the distributions (Schwenk 2011, eq. 36 to 38) have lost pi or leave the scale free: here each is normalised by
    integration (tests/test_ndf.py::test_normalisation).
    Reciprocal. The albedo of the lobe is at most 1 for specular <= 1; that of the sum need not be. Has
    kinks where two of the three terms of G are equal.
"""

CookTorrance = named(
    "cook_torrance",
    ("beckmann", "vcavity", "schlick", "lambert"),
    """f = diffuse/pi + F_schlick(specular, c_d) D_beckmann G_vcavity / (4 n.l n.v) (Cook & Torrance 1982, eq. 2 to 4)."""
    + _COMMON,
    ("cook1982",),
)
CookTorranceBlinn = named(
    "cook_torrance_blinn",
    ("blinn", "vcavity", "schlick", "lambert"),
    """f = diffuse/pi + F_schlick(specular, c_d) D_blinn G_vcavity / (4 n.l n.v), D_blinn = (exponent + 2)/(2 pi)
    (n.h)^exponent (Blinn 1977; Schwenk 2011, eq. 35 and 37)."""
    + _COMMON,
    ("cook1982",),
)
CookTorranceGaussian = named(
    "cook_torrance_gaussian",
    ("gaussian", "vcavity", "schlick", "lambert"),
    """f = diffuse/pi + F_schlick(specular, c_d) D G_vcavity / (4 n.l n.v), D = k exp(-theta_h^2/alpha^2) normalised
    (Torrance & Sparrow 1967; Blinn 1977; Schwenk 2011, eq. 35 and 36, where k is free)."""
    + _COMMON,
    ("cook1982",),
)
