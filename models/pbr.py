"""The physically based shading of real-time renderers: microfacets over a body that gets what they transmit."""

from __future__ import annotations

from .factory import named

PBR = named(
    "pbr",
    ("ggx", "smith", "schlick", "transmitted"),
    """f = (1 - F) diffuse/pi + F D_ggx G / (4 n.l n.v), F = F_schlick(specular, c_d), G height-correlated Smith of D_ggx.

    Options, by ``brdfit.microfacet(ndf, masking, "schlick", "transmitted")``: "ggx" with masking "smith",
    "smith_separable", or the approximations "hammon" (correlated) and "schlick_smith" (separable); "beckmann" with "smith",
    "smith_separable", "walter" and "walter_separable".

    Reciprocal. 1 - F is taken at the half vector, so what the body gets is not what the lobe leaves: diffuse = 1 with
    specular = 0 returns 1.03 at 60 degrees, 1.34 at 80 and 1.64 at grazing
    (tests/test_microfacet_models.py::test_energy_of_models). Known failures: diffuse and specular trade off where F0 is
    large; in float32 1 - F is good to 1e-4 at grazing.
    """,
)
