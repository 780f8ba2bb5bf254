"""SGD: Bagher's shifted gamma distribution with exact Smith masking, every parameter per channel."""

from __future__ import annotations

from typing import ClassVar

from jaxtyping import Array, Float

from . import ndf
from .base import NOT_NEGATIVE, POSITIVE, REAL, parameter
from .common import diffuse_parameter
from .fresnel import sgd_fresnel
from .masking import smith_separable
from .parts import Composition, Lobe, Parts


class SGD(Composition):
    """f = diffuse/pi + specular F_sgd D_sgd G1(l) G1(v) / (4 n.l n.v), G1 the exact Smith masking of D_sgd.

    Bagher et al. (2012) divide by pi instead of 4 and use a fitted approximation of G1; both are absorbed here (see the
    published presets for their exact form). Reciprocal. Conserves energy for 0 <= F_sgd <= 1 and diffuse + specular <= 1,
    but the form bounds neither. Of the 300 channels of the published fits, 7 have F_sgd below 0 somewhere, down to -0.073,
    where the lobe takes light from the body term; and 10 return more than falls on them at 88 degrees, at the worst 2.61
    times as much (white-paint, of specular 5.3; tests/test_energy.py::test_published_fits_of_sgd).

    Known failure: specular -> 0 with specular f0 finite is a real optimum of some channels, and f0 is then huge.
    """

    name: ClassVar[str] = "sgd"
    references: ClassVar[tuple[str, ...]] = ("bagher2012", "smith1967", "heitz2014")

    diffuse: Float[Array, " C"] = diffuse_parameter()
    specular: Float[Array, " C"] = parameter(
        "scale of the lobe", per_channel=True, linear=True, valid=NOT_NEGATIVE, search=(1e-12, float("inf")), default=0.5
    )
    alpha: Float[Array, " C"] = parameter(
        "lobe width (mean square slope)", per_channel=True, valid=POSITIVE, search=(1e-7, 30), default=0.1, log=True
    )
    p: Float[Array, " C"] = parameter("fall-off of the tail", per_channel=True, valid=REAL, search=(-10, 60), default=0.5)
    f0: Float[Array, " C"] = parameter("Fresnel constant", per_channel=True, linear=True, valid=REAL, default=0.04)
    f1: Float[Array, " C"] = parameter("Fresnel linear term", per_channel=True, linear=True, valid=REAL, default=0.0)

    @classmethod
    def shapes(cls, half_width: float) -> list[dict[str, float]]:
        """Those of the lobe."""
        return ndf.SGD.shapes(half_width)

    parts: ClassVar[Parts] = Parts(
        albedo=lambda m, g: m.diffuse,
        lobes=(Lobe(lambda m: ndf.SGD(m.alpha, m.p), lambda m, g: m.specular * sgd_fresnel(m.f0, m.f1, g)),),
        visibility=smith_separable,
    )
