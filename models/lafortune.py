"""Lafortune: one to three cosine lobes, each about a direction that the light's direction is scaled to."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import Geometry
from .base import BRDF, Interval, parameter
from .common import diffuse_parameter, exponent_parameter, exponent_shapes, lobe_parameter
from .diffuse import lambert
from .mirror import cosine_power, mirror_deficit


def _tilt() -> Any:
    return parameter(
        "angle of the lobe's axis, tan = -C_xy/C_z",
        unit="rad",
        valid=Interval(-math.pi / 2, math.pi / 2),
        default=math.pi / 4,
    )


def _lobe(tilt: Float[Array, ""], exponent: Float[Array, ""], g: Geometry) -> Float[Array, "..."]:
    """(e + 2)/(2 pi) x^e, x = (C_xy (l_x v_x + l_y v_y) + C_z l_z v_z)/max(|C_xy|, C_z), 0 where x < 0.

    1 - x is formed as a sum of what is not negative: 1 - r.v or 1 - l.v, and what the lobe is off these directions.
    """
    s, c = jnp.where(tilt >= 0, 1, -1) * jnp.sin(tilt), jnp.cos(tilt)
    largest = jnp.maximum(s, c)
    across, along = s / largest, c / largest
    product = g.cos_i * g.cos_o
    rest = g.sin2_d + g.cos_d**2 * g.sin2_h + (g.cos_i - g.cos_o) ** 2 / 4  # 1 - product
    deficit = across * jnp.where(tilt >= 0, mirror_deficit(g), 2 * g.sin2_d) + (1 - across) * rest + (1 - along) * product
    return (exponent + 2) / (2 * jnp.pi) * cosine_power(deficit, exponent)


def _numbered(*lobes: tuple[float, float]) -> dict[str, float]:
    """Parameters of lobes given by tilt and exponent."""
    tilts = {f"tilt_{k}": t for k, (t, _) in enumerate(lobes, 1)}
    return tilts | {f"exponent_{k}": max(e, 1.0) for k, (_, e) in enumerate(lobes, 1)}


class Lafortune(BRDF):
    """f = diffuse/pi + specular (e + 2)/(2 pi) [(C_xy (l_x v_x + l_y v_y) + C_z l_z v_z)/max(|C_xy|, C_z)]^e, 0 where the
    bracket is negative; tan(tilt) = -C_xy/C_z (Lafortune et al. 1997; Schwenk 2011, eq. 45; in the
    scale of Ngan et al. 2005).

    The published C_x = C_y and C_z have a scale, which only multiplies the lobe: what is left is the angle tilt. At pi/4 the
    lobe is Phong's, beyond it leans to grazing, as measured lobes do, and at -pi/4 it returns to the light. One angle and
    exponent for all channels, as in the published fits; the paper has a vector for each.
    Reciprocal. Energy is not bounded by the form. Known failures: off the angle pi/4 the scale changes with incidence; at
    pi/4 and -pi/4 the BRDF has a kink in tilt, where the largest of |C_xy| and C_z changes.
    """

    name: ClassVar[str] = "lafortune"
    references: ClassVar[tuple[str, ...]] = ("lafortune1997", "ngan2005", "schwenk2011")

    diffuse: Float[Array, " C"] = diffuse_parameter()
    specular: Float[Array, " C"] = lobe_parameter()
    tilt: Float[Array, ""] = _tilt()
    exponent: Float[Array, ""] = exponent_parameter()

    @classmethod
    def shapes(cls, half_width: float) -> list[dict[str, float]]:
        """Exponents near that of the lobe, at the mirror direction and beyond it, and one that returns to the light."""
        found = [{"tilt": t, **e} for e in exponent_shapes(2 * half_width) for t in (0.79, 0.95)]
        return [*found, {"tilt": -0.79, "exponent": 5.0}]

    def evaluate(self, g: Geometry) -> Float[Array, "..."]:
        """Value in 1/sr."""
        return lambert(self.diffuse) + self.specular * _lobe(self.tilt, self.exponent, g)


class Lafortune2(BRDF):
    """f = diffuse/pi + the sum of two lobes as those of :class:`Lafortune` (Schwenk 2011, eq. 45).

    Known failures: as there; and lobes that are alike share their scale in any proportion.
    """

    name: ClassVar[str] = "lafortune2"
    references: ClassVar[tuple[str, ...]] = ("lafortune1997", "ngan2005", "schwenk2011")

    diffuse: Float[Array, " C"] = diffuse_parameter()
    specular_1: Float[Array, " C"] = lobe_parameter()
    specular_2: Float[Array, " C"] = lobe_parameter()
    tilt_1: Float[Array, ""] = _tilt()
    tilt_2: Float[Array, ""] = _tilt()
    exponent_1: Float[Array, ""] = exponent_parameter()
    exponent_2: Float[Array, ""] = exponent_parameter()

    @classmethod
    def shapes(cls, half_width: float) -> list[dict[str, float]]:
        """The lobe with a wider one, a narrower one, or one that returns to the light."""
        first = exponent_shapes(2 * half_width)[1:4]
        second = [(t, k) for k in (0.05, 0.2) for t in (0.79, 1.0)]
        found = [_numbered((0.8, e["exponent"]), (t, e["exponent"] * k)) for e in first for t, k in second]
        return found + [_numbered((0.8, e["exponent"]), (-0.79, 5.0)) for e in first]

    def evaluate(self, g: Geometry) -> Float[Array, "..."]:
        """Value in 1/sr."""
        first = self.specular_1 * _lobe(self.tilt_1, self.exponent_1, g)
        return lambert(self.diffuse) + first + self.specular_2 * _lobe(self.tilt_2, self.exponent_2, g)


class Lafortune3(BRDF):
    """f = diffuse/pi + the sum of three lobes as those of :class:`Lafortune` (Schwenk 2011, eq. 45).

    Known failures: as of :class:`Lafortune2`.
    """

    name: ClassVar[str] = "lafortune3"
    references: ClassVar[tuple[str, ...]] = ("lafortune1997", "ngan2005", "schwenk2011")

    diffuse: Float[Array, " C"] = diffuse_parameter()
    specular_1: Float[Array, " C"] = lobe_parameter()
    specular_2: Float[Array, " C"] = lobe_parameter()
    specular_3: Float[Array, " C"] = lobe_parameter()
    tilt_1: Float[Array, ""] = _tilt()
    tilt_2: Float[Array, ""] = _tilt()
    tilt_3: Float[Array, ""] = _tilt()
    exponent_1: Float[Array, ""] = exponent_parameter()
    exponent_2: Float[Array, ""] = exponent_parameter()
    exponent_3: Float[Array, ""] = exponent_parameter()

    @classmethod
    def shapes(cls, half_width: float) -> list[dict[str, float]]:
        """Three lobes of falling width, or two and one that returns to the light."""
        first = [e["exponent"] for e in exponent_shapes(2 * half_width)[1:4]]
        found = [_numbered((0.79, e), (t, e * 0.1), (1.0, e * 0.02)) for e in first for t in (0.79, 1.0)]
        return found + [_numbered((0.79, e), (-0.79, 5.0), (t, e * 0.1)) for e in first for t in (0.7, 1.0)]

    def evaluate(self, g: Geometry) -> Float[Array, "..."]:
        """Value in 1/sr."""
        first = self.specular_1 * _lobe(self.tilt_1, self.exponent_1, g)
        second = self.specular_2 * _lobe(self.tilt_2, self.exponent_2, g)
        return lambert(self.diffuse) + first + second + self.specular_3 * _lobe(self.tilt_3, self.exponent_3, g)
