"""Student's t: one lobe from GGX and heavier tails to Beckmann."""

from __future__ import annotations

from .factory import named

StudentT = named(
    "student_t",
    ("student_t", "smith", "schlick", "lambert"),
    """f = diffuse/pi + F_schlick(specular, c_d) D G / (4 n.l n.v), D = 1/(pi alpha^2 cos^4 theta_h (1 + tan^2 theta_h/
    ((gamma - 1) alpha^2))^gamma), Student's t-distribution of slopes (Ribardière et al. 2017), G its
    height-correlated Smith masking.

    gamma = 2 is GGX, gamma -> infinity Beckmann. Ribardière et al. approximate Lambda by a product of fitted functions;
    here it is Smith's integral. Reciprocal. The lobe conserves energy for specular <= 1. Known failures: for gamma < 2 D
    grows without bound towards the horizon, and the derivative of G at normal incidence is infinite (given as large); as
    gamma -> infinity it is not determined.
    """,
)
