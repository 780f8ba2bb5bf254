"""Lafortune: cosine lobes, each about a direction that the light's direction is scaled to."""

from __future__ import annotations

import math
from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import Geometry
from .assembled import assemble
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
    steep, ratio = s > c, jnp.minimum(s, c) / jnp.maximum(s, c)
    # not s and c over the larger of them, whose derivative is then 0 but for rounding, which a large exponent multiplies
    across, along = jnp.where(steep, 1, ratio), jnp.where(steep, ratio, 1)
    product = g.cos_i * g.cos_o
    rest = g.sin2_d + g.cos_d**2 * g.sin2_h + (g.cos_i - g.cos_o) ** 2 / 4  # 1 - product
    deficit = across * jnp.where(tilt >= 0, mirror_deficit(g), 2 * g.sin2_d) + (1 - across) * rest + (1 - along) * product
    return (exponent + 2) / (2 * jnp.pi) * cosine_power(deficit, exponent)


def _evaluate(self: Any, g: Geometry) -> Float[Array, "..."]:
    """Value in 1/sr."""
    total = lambert(self.diffuse)
    for end in self.ends:
        scale, tilt, exponent = (getattr(self, name + end) for name in ("specular", "tilt", "exponent"))
        total = total + scale * _lobe(tilt, exponent, g)
    return total


def _shapes(cls: Any, half_width: float) -> list[dict[str, float]]:
    """One lobe near the mirror direction or beyond it, or one that returns to the light; of several the first is that of the
    data, and the others are ever wider or return to the light.
    """
    widths = [e["exponent"] for e in exponent_shapes(2 * half_width)]
    count = len(cls.ends)
    if count == 1:
        return [{"tilt": t, "exponent": e} for e in widths for t in (0.79, 0.95)] + [{"tilt": -0.79, "exponent": 5.0}]
    falls = ((0.05,), (0.2,)) if count == 2 else (tuple(0.1 / 5**k for k in range(count - 1)),)
    found = [
        ((0.79, e), (t, e * fall[0]), *((1.0, e * f) for f in fall[1:]))
        for e in widths[1:4]
        for fall in falls
        for t in (0.79, 1.0)
    ]
    found += [
        ((0.79, e), (-0.79, 5.0), *((t, e * 0.1 / 5**k) for k in range(count - 2)))
        for e in widths[1:4]
        for t in ((0.7, 1.0) if count > 2 else (1.0,))
    ]
    return [
        {f"tilt{end}": t for end, (t, _) in zip(cls.ends, lobes, strict=True)}
        | {f"exponent{end}": max(e, 1.0) for end, (_, e) in zip(cls.ends, lobes, strict=True)}
        for lobes in found
    ]


_SHAPES = classmethod(_shapes)

_ONE = """f = diffuse/pi + specular (e + 2)/(2 pi) [(C_xy (l_x v_x + l_y v_y) + C_z l_z v_z)/max(|C_xy|, C_z)]^e, 0 where the
    bracket is negative; tan(tilt) = -C_xy/C_z (Lafortune et al. 1997; Schwenk 2011, eq. 45; in the scale of Ngan et al.
    2005).

    The survey's eq. 45 has lost the pi under k_d and the product, component by component, of o_j and the light's direction.
    The published C_x = C_y and C_z have a scale, which only multiplies the lobe: what is left is the angle tilt. At pi/4 the
    lobe is Phong's, beyond it leans to grazing, as measured lobes do, and at -pi/4 it returns to the light. One angle and
    exponent for all channels, as in the published fits; the paper has a vector for each. By the factor (e + 2)/(2 pi) the
    albedo of Phong's lobe at normal incidence is specular.
    Reciprocal. Energy is not bounded by the form. Known failures: off the angle pi/4 the scale changes with incidence; at
    pi/4 and -pi/4 the BRDF has a kink in tilt, where the largest of |C_xy| and C_z changes.
    """
_SEVERAL = """f = diffuse/pi + the sum of {} lobes as that of ``lafortune`` (Lafortune et al. 1997; Schwenk 2011, eq. 45).

    Known failures: as there; and lobes that are alike share their scale in any proportion.
    """


def lobes(count: int) -> type[BRDF]:
    """Lafortune's model of ``count`` lobes: of one it is ``lafortune``, of more ``lafortune2`` and so on.

    Raises ValueError for fewer than one.
    """
    if count < 1:
        raise ValueError(f"Lafortune's model has at least one lobe, not {count}")
    ends = ("",) if count == 1 else tuple(f"_{k}" for k in range(1, count + 1))
    return assemble(
        "lafortune" if count == 1 else f"lafortune{count}",
        {
            "diffuse": diffuse_parameter(),
            **{f"specular{end}": lobe_parameter() for end in ends},
            **{f"tilt{end}": _tilt() for end in ends},
            **{f"exponent{end}": exponent_parameter() for end in ends},
        },
        _evaluate,
        doc=_ONE if count == 1 else _SEVERAL.format(count),
        references=("lafortune1997", "ngan2005", "schwenk2011"),
        ends=ends,
        shapes=_SHAPES,
    )


Lafortune, Lafortune2, Lafortune3 = lobes(1), lobes(2), lobes(3)
