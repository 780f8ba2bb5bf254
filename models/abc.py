"""ABC: Low's microfacet model, a two-parameter lobe with dielectric Fresnel and V-cavity masking."""

from __future__ import annotations

from itertools import product
from typing import ClassVar

import numpy as np
from jaxtyping import Array, Float

from . import ndf
from .base import NOT_NEGATIVE, POSITIVE, Interval, parameter
from .common import diffuse_parameter
from .fresnel import dielectric
from .masking import vcavity
from .parts import Composition, Lobe, Parts


class ABC(Composition):
    """f = diffuse/pi + specular F_dielectric(ior, c_d) D_abc G_vcavity / (4 n.l n.v) (Low et al. 2012, eq. 15).

    Low et al. leave D unnormalised and divide by pi; here D is normalised, so that specular is a scale near 1.
    Reciprocal. The albedo is at most diffuse + specular, and specular is not bounded. Published fits return at most 0.69 at
    88 degrees (tests/test_energy.py::test_published_fits_of_abc).
    Known failures: specular and ior trade off along a ridge; the derivative in ior nearly vanishes at ior 7.6 to 11, and
    most materials have a second optimum at ior -> infinity.
    """

    name: ClassVar[str] = "abc"
    references: ClassVar[tuple[str, ...]] = ("low2012", "church1990", "cook1982")

    diffuse: Float[Array, " C"] = diffuse_parameter()
    specular: Float[Array, " C"] = parameter(
        "scale of the lobe", per_channel=True, linear=True, valid=NOT_NEGATIVE, default=1.0
    )
    b: Float[Array, ""] = parameter("inverse width of the lobe", valid=POSITIVE, search=(1e-2, 1e9), default=100, log=True)
    c: Float[Array, ""] = parameter("fall-off of the tail", valid=NOT_NEGATIVE, search=(1e-3, 1e4), default=1, log=True)
    ior: Float[Array, ""] = parameter("index of refraction", valid=Interval(1), search=(1.001, 1001), default=1.5, log=True)

    @classmethod
    def shapes(cls, half_width: float) -> list[dict[str, float]]:
        """Tails and indices crossed, the width as each tail has it."""
        vers = 1 - np.cos(half_width)
        shapes = []
        for c, ior, scale in product((0.4, 0.7, 1.0, 1.6, 4.0), (1.3, 1.7, 6.0, 60.0), (1.0, 0.2)):
            shapes.append({"b": float(np.expm1(np.log(2) / c) / (vers * scale)), "c": c, "ior": ior})
        return shapes + [{"b": float(1 / vers), "c": 20.0, "ior": ior} for ior in (1.5, 60.0)]

    parts: ClassVar[Parts] = Parts(
        albedo=lambda m, g: m.diffuse,
        lobes=(Lobe(lambda m: ndf.ABC(m.b, m.c), lambda m, g: m.specular * dielectric(m.ior, g)),),
        visibility=lambda facets, g: vcavity(g),
    )
