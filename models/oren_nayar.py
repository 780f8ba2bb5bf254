"""Oren-Nayar: a rough body and nothing else, in its qualitative and in its full form."""

from __future__ import annotations

from typing import Any, ClassVar

from jaxtyping import Array, Float

from ..geometry import Geometry
from .base import BRDF, NOT_NEGATIVE, parameter
from .common import diffuse_parameter
from .diffuse import oren_nayar, oren_nayar_full


def _sigma() -> Any:
    return parameter(
        "standard deviation of the slope angle", unit="rad", valid=NOT_NEGATIVE, search=(1e-2, 3), default=0.4, log=True
    )


class OrenNayar(BRDF):
    """f = diffuse/pi (A + B max(0, cos(phi_i - phi_o)) sin(alpha) tan(beta)), A = 1 - sigma^2/(2 (sigma^2 + 0.33)),
    B = 0.45 sigma^2/(sigma^2 + 0.09), alpha the larger and beta the smaller polar angle (Oren & Nayar 1994; Schwenk 2011,
    eq. 34).

    The survey's A has lost its fraction and its sigmas: with 1/2 sigma^2/(sigma^2 + 0.33), sigma = 0 is Lambert's law.
    Reciprocal. Without interreflection, so that it darkens with roughness at normal incidence; towards grazing its albedo
    may exceed diffuse by 1.6 % (A + B/2, greatest at sigma 0.2). Shows no highlight at all. Known failure: sigma beyond 1 is
    all but undetermined, A and B having saturated.
    """

    name: ClassVar[str] = "oren_nayar"
    references: ClassVar[tuple[str, ...]] = ("oren1994", "schwenk2011")

    diffuse: Float[Array, " C"] = diffuse_parameter()
    sigma: Float[Array, ""] = _sigma()

    @classmethod
    def shapes(cls, half_width: float) -> list[dict[str, float]]:
        """From smooth to rough; the half-width says nothing of a body."""
        return [{"sigma": s} for s in (0.1, 0.3, 0.6, 1.5)]

    def evaluate(self, g: Geometry) -> Float[Array, "..."]:
        """Value in 1/sr."""
        return oren_nayar(self.diffuse, self.sigma, g)


class OrenNayarFull(BRDF):
    """f = diffuse/pi [C1 + c C2 tan(beta) + (1 - |c|) C3 tan((alpha + beta)/2)]
    + 0.17 diffuse^2/pi sigma^2/(sigma^2 + 0.13) [1 - c (2 beta/pi)^2], c = cos(phi_i - phi_o) (Oren & Nayar 1994,
    the functional form with interreflection; the coefficients stand at :func:`~brdfit.models.diffuse.oren_nayar_full`).

    The last term is light reflected twice within a groove: the BRDF is not affine in diffuse. Reciprocal. Energy is not
    bounded by the form, C1 to C3 being fits to numerical integrals. Known failures: for sigma above some 0.6 it is negative
    between grazing light and a grazing viewer opposite; in float32 slopes by directions that both graze have two digits.
    """

    name: ClassVar[str] = "oren_nayar_full"
    references: ClassVar[tuple[str, ...]] = ("oren1994",)

    diffuse: Float[Array, " C"] = parameter("albedo of the walls", per_channel=True, valid=NOT_NEGATIVE, default=0.5)
    sigma: Float[Array, ""] = _sigma()

    @classmethod
    def shapes(cls, half_width: float) -> list[dict[str, float]]:
        """From smooth to rough; the half-width says nothing of a body."""
        return [{"sigma": s} for s in (0.1, 0.3, 0.6, 1.5)]

    def evaluate(self, g: Geometry) -> Float[Array, "..."]:
        """Value in 1/sr."""
        return oren_nayar_full(self.diffuse, self.sigma, g)
