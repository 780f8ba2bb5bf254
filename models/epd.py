"""EPD: a lobe between Beckmann's and sharper ones."""

from __future__ import annotations

from .factory import named

EPD = named(
    "epd",
    ("epd", "smith", "schlick", "lambert"),
    """f = diffuse/pi + F_schlick(specular, c_d) D_epd G / (4 n.l n.v), D_epd the exponential power distribution of slopes
    exp(-(tan^2 theta_h/alpha^2)^p)/(pi alpha^2 Gamma(1 + 1/p) cos^4 theta_h) (Holzschuch & Pacanowski 2017, without their
    diffraction lobe), G its exact height-correlated Smith masking.

    Reciprocal. The lobe conserves energy for specular <= 1. At the mirror direction derivatives by directions do not exist
    for p <= 1/2 and are given as 0. Known failures: for p < 0.3 alpha and p trade off (only the tail is determined).
    """,
)
