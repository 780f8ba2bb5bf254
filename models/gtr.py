"""GTR: Burley's generalised Trowbridge-Reitz lobe with Schlick's Fresnel and its own exact Smith masking."""

from __future__ import annotations

from typing import ClassVar

from jaxtyping import Array, Float

from . import ndf
from .base import NOT_NEGATIVE, POSITIVE, parameter
from .common import diffuse_parameter
from .effects import parts_of
from .parts import Composition, Parts


class GTR(Composition):
    """f = diffuse/pi + F_schlick(specular, c_d) D_gtr G / (4 n.l n.v), G height-correlated Smith of D_gtr itself.

    Reciprocal. The albedo of the lobe is at most 1 for specular <= 1; that of the sum is at most diffuse + 1, since the body
    term ignores the lobe, and reaches it at grazing on smooth surfaces (tests/test_energy.py::test_gtr_on_top_of_its_body).
    Known failures: as alpha -> 0 the lobe becomes a power law in which alpha only scales specular against the grazing
    term (a ridge); as gamma -> infinity only gamma (1/alpha^2 - 1) is determined.
    """

    name: ClassVar[str] = "gtr"
    references: ClassVar[tuple[str, ...]] = ("burley2012", "schlick1994", "smith1967", "heitz2014")

    diffuse: Float[Array, " C"] = diffuse_parameter()
    specular: Float[Array, " C"] = parameter(
        "reflectance at normal incidence, F0", per_channel=True, linear=True, valid=NOT_NEGATIVE, search=(0, 1), default=0.04
    )
    alpha: Float[Array, ""] = parameter("lobe width", valid=POSITIVE, search=(1e-9, 10), default=0.1, log=True)
    gamma: Float[Array, ""] = parameter(
        "fall-off of the tail (2: GGX, 1: Berry)", valid=POSITIVE, search=(0.01, 1e7), default=2, log=True
    )

    effects: ClassVar[tuple[str, ...]] = ("body", "lobe", "tail", "fresnel", "masking")
    parts: ClassVar[Parts] = parts_of(*effects)

    @classmethod
    def shapes(cls, half_width: float) -> list[dict[str, float]]:
        """Those of the lobe."""
        return ndf.GTR.shapes(half_width)
