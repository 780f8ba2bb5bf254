"""Ward-Dür: Ward's lobe with the divisor that keeps its energy towards grazing."""

from __future__ import annotations

from typing import ClassVar

from jaxtyping import Array, Float

from ..geometry import Geometry
from . import ndf
from .base import BRDF
from .common import diffuse_parameter, stretched_shapes
from .diffuse import lambert
from .ward import Ward, specular_parameter, width_parameter


class WardDuer(BRDF):
    """f = diffuse/pi + specular exp(-tan^2(theta_h)/alpha^2) / (4 pi alpha^2 n.l n.v) (Dür 2006).

    Ward (1992) has sqrt(n.l n.v) in its divisor and so loses energy towards grazing. Reciprocal. Does not conserve energy:
    towards grazing the albedo of the lobe rises as 0.085 specular/n.l at alpha = 0.72, to 1.3 specular at 85 degrees
    and 5.1 at 89 (tests/test_microfacet_models.py::test_energy_of_models).
    """

    name: ClassVar[str] = "ward_duer"
    references: ClassVar[tuple[str, ...]] = ("duer2006", "ward1992")

    diffuse: Float[Array, " C"] = diffuse_parameter()
    specular: Float[Array, " C"] = specular_parameter()
    alpha: Float[Array, ""] = width_parameter("lobe width (rms slope times sqrt 2)")

    @classmethod
    def shapes(cls, half_width: float) -> list[dict[str, float]]:
        """Those of Ward's lobe."""
        return Ward.shapes(half_width)

    def evaluate(self, g: Geometry) -> Float[Array, "..."]:
        """Value in 1/sr."""
        return lambert(self.diffuse) + self.specular * (ndf.gaussian(g.tan2_h, self.alpha) / (4 * g.cos_i * g.cos_o))


class WardDuerAnisotropic(BRDF):
    """As :class:`WardDuer` with exp(-tan^2 (cos^2 phi_h/alpha_x^2 + sin^2 phi_h/alpha_y^2))/(alpha_x alpha_y) (Dür 2006),
    which it equals for alpha_x = alpha_y.
    """

    name: ClassVar[str] = "ward_duer"
    references: ClassVar[tuple[str, ...]] = ("duer2006", "ward1992")
    anisotropic: ClassVar[bool] = True

    diffuse: Float[Array, " C"] = diffuse_parameter()
    specular: Float[Array, " C"] = specular_parameter()
    alpha_x: Float[Array, ""] = width_parameter("lobe width along the tangent")
    alpha_y: Float[Array, ""] = width_parameter("lobe width along the bitangent")

    @classmethod
    def shapes(cls, half_width: float) -> list[dict[str, float]]:
        """Those of the round lobe, stretched."""
        return stretched_shapes(Ward.shapes(half_width), "alpha")

    def evaluate(self, g: Geometry) -> Float[Array, "..."]:
        """Value in 1/sr."""
        d = ndf.anisotropic_gaussian(*g.slopes(), self.alpha_x, self.alpha_y)
        return lambert(self.diffuse) + self.specular * (d / (4 * g.cos_i * g.cos_o))
