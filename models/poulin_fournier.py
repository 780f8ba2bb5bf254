"""Poulin-Fournier: a floor with parallel cylinders, which hide each other and the floor from the light and the viewer."""

from __future__ import annotations

import math
from typing import ClassVar, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import Geometry
from ..quadrature import gauss_legendre
from ..special import root
from .base import BRDF, Interval, parameter
from .common import diffuse_parameter, exponent_parameter, exponent_shapes, lobe_parameter
from .diffuse import lambert
from .modified_blinn_phong import half_vector_scale
from .ndf.power_cosine import log_cosine

NODES = 32
FAINT = 27.0
"""What is left out of the lobe is e^-27 of its highest on the arc, 2e-12."""
FLAT = 1.0
"""Exponents below have nodes closer to the ends of the arc, where the integrand may end in a power that is no integer."""

Field = Float[Array, "..."]


class PoulinFournier(BRDF):
    """f = 1/d [int f_m(m) (m.l)(m.v)/((n.l)(n.v)) dtheta + w f_m(n)], f_m(m) = diffuse/pi + specular S(e) (m.h)^e (after
    Poulin & Fournier 1990).

    Cylinders of radius 1 lie along the tangent, their axes ``spacing`` d apart and ``elevation`` above the floor. The
    integral goes over the normals m = (0, sin(theta), cos(theta)) of one cylinder that are above the floor and neither in
    the shadow of the next cylinder nor hidden by it, an arc; w is the width of the floor between two of which the same
    holds. So the diffuse part is exact, as in the paper. Its abstract gives the two lengths and this rule; the surveys give
    no formula (Schwenk 2011, section 3.11.2). Settled here: cylinders and floor are of one material; the floor between
    cylinders counts, with their shadows; cylinders rise from the floor and are not cut out of it; the lobe is that of
    ``modified_blinn_phong``, S(e) its scale, and is integrated by quadrature, for which the paper has a polynomial.
    Reciprocal; conserves energy for diffuse + specular <= 1: light that goes on to a second cylinder is lost. It is
    ``modified_blinn_phong`` for elevation = -1, and nearly so for a large spacing. There is no isotropic form: the mean over
    all azimuths of the cylinders has no closed form.
    The quadrature errs by 2e-12 of the lobe, and by 2e-11 where f is below 1e-12. Known failures: f has kinks where one
    cylinder begins to hide the next or all of the floor, and where light and viewer are equally steep across the cylinders;
    the slope by elevation vanishes at -1.
    """

    name: ClassVar[str] = "poulin_fournier"
    references: ClassVar[tuple[str, ...]] = ("poulin1990", "schwenk2011")
    anisotropic: ClassVar[bool] = True

    diffuse: Float[Array, " C"] = diffuse_parameter()
    specular: Float[Array, " C"] = lobe_parameter()
    exponent: Float[Array, ""] = exponent_parameter()
    spacing: Float[Array, ""] = parameter(
        "distance between axes of cylinders", unit="radius", valid=Interval(2), search=(2, 100), default=3, log=True
    )
    elevation: Float[Array, ""] = parameter(
        "height of the axes above the floor", unit="radius", valid=Interval(-1, 1), default=0
    )

    @classmethod
    def shapes(cls, half_width: float) -> list[dict[str, float]]:
        """Lobes narrower and wider than that of the data, on cylinders that are nearly sunken, half sunken and raised."""
        profiles = ((2.3, -0.5), (3.0, 0.0), (3.0, 0.6))
        return [{**e, "spacing": d, "elevation": h} for e in exponent_shapes(half_width)[1:5] for d, h in profiles]

    def evaluate(self, g: Geometry) -> Float[Array, "..."]:
        """Value in 1/sr."""
        light, viewer = (w[..., 1] for w in g.directions())
        # both at once: with a program each, compiled without optimisations, derivatives take a hundred times as long
        y, z = (jnp.stack(jnp.broadcast_arrays(*pair)) for pair in ((light, viewer), (g.cos_i, g.cos_o)))
        free = _free(y, z, self.spacing, self.elevation)
        right, left = jnp.min(free.right, 0), jnp.min(free.left, 0)
        width = self.spacing - jnp.max(free.shade_right, 0) - jnp.max(free.shade_left, 0)
        # not max: where the shades just meet, as at normal incidence on cylinders that touch, the slope is that of wider
        # spacings (tests/test_poulin_fournier.py::test_cylinders_that_touch)
        width = jnp.where(width >= 0, width, 0)
        tilts = light / g.cos_i, viewer / g.cos_o
        body = _body(right, left, tilts) + width
        lobe = _lobe(self.exponent, right, left, tilts, light + viewer, g)
        lobe = lobe + width * jnp.exp(self.exponent * log_cosine(g.sin2_h, g.cos2_h))
        scale = half_vector_scale(self.exponent)
        return (lambert(self.diffuse) * body + self.specular * (scale * lobe)) / self.spacing


class _Free(NamedTuple):
    """What is free to one direction. The right is the side of the bitangent."""

    right: Field
    """From the top of a cylinder to the ends of its arc, radians."""
    left: Field
    shade_right: Field
    """From the axis of a cylinder to the ends of the floor that it hides."""
    shade_left: Field


def _free(y: Field, z: Field, spacing: Float[Array, ""], elevation: Float[Array, ""]) -> _Free:
    """What is free to the direction of bitangent component ``y`` and height ``z``.

    Its angle to the normal across the cylinders be alpha, to the right. A cylinder is above the floor for |theta| <=
    acos(-h), faces the direction for theta >= alpha - 90 degrees, and its right neighbour leaves sin(theta - alpha) <=
    d cos(alpha) - 1. It hides the floor up to (1 + h sin(alpha))/cos(alpha) from its axis, where a ray that touches it comes
    down, or up to its foot, sqrt(1 - h^2), where no ray can touch it. To the left alpha changes its sign.
    """
    side = jnp.where(y >= 0, 1, -1)
    across = jnp.sqrt(y * y + z * z)
    sine, cosine = side * y / across, z / across
    low = jnp.arctan2(z, side * y)  # 90 degrees - alpha, which next to the horizon is no difference
    above, below = _root(1 + elevation), _root(1 - elevation)
    foot = 2 * jnp.arctan2(above, below)
    gap = 2 - spacing + spacing * sine * sine / (1 + cosine)  # 2 - d cos(alpha)
    # Guard: the slope of the root is infinite where the neighbour begins to hide something
    # (tests/test_poulin_fournier.py::test_cylinders_that_touch).
    passed = gap <= 0
    blocked = 2 * jnp.arctan2(jnp.sqrt(spacing * cosine), jnp.sqrt(jnp.where(passed, 1, gap)))
    turn = jnp.where(passed, jnp.pi, blocked)  # 90 degrees + asin(d cos(alpha) - 1)
    towards, away = jnp.minimum(foot, turn - low), jnp.minimum(foot, low)
    # (1 + h sin(alpha))/cos(alpha) as a sum of what is not negative
    far, near = ((1 + h) * sine / cosine + cosine / (1 + sine) for h in (elevation, -elevation))
    far, near = jnp.where(sine > -elevation, far, above * below), jnp.where(sine < elevation, near, above * below)
    right = side > 0
    return _Free(
        jnp.where(right, towards, away),
        jnp.where(right, away, towards),
        jnp.where(right, far, near),
        jnp.where(right, near, far),
    )


def _root(x: Float[Array, ""]) -> Float[Array, ""]:
    """The root of x >= 0, with no slope at 0.

    Guard: it has none there; what follows of it, an arc and the floor below it, is equal to the first order
    (tests/test_models.py::test_finite).
    """
    return jnp.where(x > 0, jnp.sqrt(jnp.where(x > 0, x, 1)), 0)


_EXCESS = tuple((-1) ** k / math.factorial(2 * k + 3) for k in range(16))


def _excess(x: Field) -> Field:
    """(x - sin(x))/x^3 for 0 <= x <= pi, by its Taylor series, of which the first term left out is 1e-22."""
    total = jnp.full_like(x, _EXCESS[-1])
    for coefficient in reversed(_EXCESS[:-1]):
        total = total * (x * x) + coefficient
    return total


def _body(right: Field, left: Field, tilts: tuple[Field, Field]) -> Field:
    """int (m.l)(m.v)/((n.l)(n.v)) dtheta over the arc, of y/z of light and viewer.

    With m0 in the middle of the arc and t the angle from there, it is (m0.l)(m0.v) int cos^2(t) dt + (m0 x l)(m0 x v)
    int sin^2(t) dt. The second term may be negative, but is at most a third of the first where no m on the arc faces away.
    """
    middle, half = (right - left) / 2, (right + left) / 2
    sine, cosine = jnp.sin(middle), jnp.cos(middle)
    (cos_l, sin_l), (cos_v, sin_v) = ((y * sine + cosine, (y * cosine - sine) * half) for y in tilts)
    return cos_l * cos_v * (half + jnp.sin(2 * half) / 2) + sin_l * sin_v * (4 * half * _excess(2 * half))


def _lobe(
    exponent: Float[Array, ""], right: Field, left: Field, tilts: tuple[Field, Field], across: Field, g: Geometry
) -> Field:
    """int (m.h)^e (m.l)(m.v)/((n.l)(n.v)) dtheta over the arc, as far as the lobe reaches; ``across`` is that of l + v.

    In u = tan(t/2), t the angle from the middle of that, so that no node needs a trigonometric function.
    """
    h_x2, h_y2 = g.tangential()
    lean = jnp.arctan2(across, g.cos_i + g.cos_o)
    # the angle from h, in projection, with cos(reach) = e^(-FAINT/e) cos(nearest), of which nearest is on the arc
    nearest = jnp.maximum(jnp.maximum(lean - right, -left - lean), 0)
    share = jnp.exp(-FAINT / exponent)
    reach = 2 * jnp.arcsin(jnp.sqrt(-jnp.expm1(-FAINT / exponent) / 2 + share * jnp.sin(nearest / 2) ** 2))
    reach = jax.lax.stop_gradient(reach)
    begin, end = jnp.maximum(-left, lean - reach), jnp.minimum(right, lean + reach)
    middle, farthest = (begin + end) / 2, jnp.tan((end - begin) / 4)
    x, weight = (jnp.asarray(a, across.dtype) for a in gauss_legendre(NODES))
    flat = exponent < FLAT
    x, weight = jnp.where(flat, x * x * (3 - 2 * x), x), jnp.where(flat, 6 * x * (1 - x) * weight, weight)
    u = farthest[..., None] * (2 * x - 1)
    per = 1 / (1 + u * u)
    sine, cosine = 2 * u * per, (1 - u) * (1 + u) * per

    def turned(angle: Field) -> tuple[Field, Field]:
        """Sine and cosine of angle + t."""
        s, c = jnp.sin(angle)[..., None], jnp.cos(angle)[..., None]
        return s * cosine + c * sine, c * cosine - s * sine

    (m_y, m_z), (off, along) = turned(middle), turned(middle - lean)
    # Guard: the logarithm of 0, at the ends of half a circle (tests/test_stability.py::test_random_draws_are_finite).
    along2 = root(along * along) ** 2
    h_x2, h_yz2 = h_x2[..., None], (h_y2 + g.cos2_h)[..., None]
    power = jnp.exp(exponent * log_cosine(h_x2 + h_yz2 * off * off, h_yz2 * along2))
    facing_l, facing_v = (y[..., None] * m_y + m_z for y in tilts)
    return 4 * farthest * ((power * facing_l * facing_v * per) @ weight)
