"""Smith masking, exact for any isotropic distribution (Smith 1967; Heitz 2014, eq. 43 and 99)."""

from __future__ import annotations

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpy.typing import NDArray

from ...geometry import Geometry
from ...quadrature import smith_kernel

NODES = 170
REACH = 28.0
"""Range of u of the quadrature: ln(2 tan(theta)) is 10 at 89.995 degrees, and u - 10 = 18 holds densities that change
within e^-10 of the horizon. A density that needs less says so as ``smith_reach``, which sets the nodes closer; one that
needs more nodes as ``smith_nodes``."""

NDF = Callable[[Float[Array, "..."], Float[Array, "..."]], Float[Array, "..."]]


Rule = tuple[NDArray[np.float64], ...]
"""Nodes and weights over t in [0, pi/2], as :func:`brdfit.quadrature.smith_kernel` gives them."""


def averted_area(ndf: NDF, cosine: Float[Array, "..."], rule: Rule | None = None) -> Float[Array, "..."]:
    """N(theta) = int max(0, -v.m) D(m) dm of any isotropic ``ndf``, at cos(theta) in (0, 1].

    The projected area of the facets that face away. As int v.m D dm = n.v, those that face the viewer have n.v + N, and
    G1 = n.v / (n.v + N). With the azimuth of m integrated in closed form,

        N = 2 sin theta int_0^(pi/2) D(m) sin theta_m g(cos t) sin theta_m dtheta_m,  g(cos t) = sin t - t cos t,
        cot(theta_m) = tan(theta) cos t,

    every factor of which is positive: nothing cancels. With c = cos(theta), s = sin(theta),
    sin^2(theta_m) = c^2/(c^2 + s^2 cos^2 t), so that no tangent is formed and normal incidence is regular.

    Towards grazing D would have to be followed as the nodes theta_m move with theta, and slopes in theta are then
    differences of terms 1/c times larger. So beyond 60 degrees the nodes are held, and theta enters through s and g alone,
    where g(cos t + d) = g - t d + d^2/(2 sin t): d is 0 and carries two derivatives.

    Error of G1 with 170 nodes, up to 89.995 degrees, against eight times as many: 1e-10 for GTR with alpha 1e-9..10 and
    gamma 0.01..1e7 (Gaussian lobes; 2e-15 for gamma < 10), 4e-14 for SGD with alpha 1e-7..30 and p -10..60
    (tests/test_masking.py::test_against_the_projected_area). ``rule`` stands in for those nodes. A distribution that has
    a form of N of its own, as its method ``averted_area``, is asked for it.
    """
    cosine = jnp.asarray(cosine)
    own = getattr(ndf, "averted_area", None)
    if own is not None:
        return jnp.asarray(own(cosine))
    rule = rule or smith_kernel(getattr(ndf, "smith_nodes", NODES), getattr(ndf, "smith_reach", REACH))
    cos2_t, g, slope, bend = (jnp.asarray(a, cosine.dtype) for a in rule)
    oblique = cosine < 0.5
    held = jnp.where(oblique, jax.lax.stop_gradient(cosine), cosine)
    # Guard: at normal incidence the slope of the root is infinite (tests/test_masking.py::test_normal_incidence).
    sine = jnp.sqrt(jnp.where(oblique, (1 - cosine) * (1 + cosine), 1))
    unmoved = sine / jax.lax.stop_gradient(sine)  # 1, and
    d = (cosine / held / unmoved - 1)[..., None]  # 0: the first two derivatives by theta at held nodes
    c2, s2 = held * held, (1 - held) * (1 + held)
    norm = c2[..., None] + s2[..., None] * cos2_t
    sin2_m, cos2_m = c2[..., None] / norm, s2[..., None] * cos2_t / norm
    # Guard: reciprocals, because the derivative of 1/norm^2 squares it, 1e41 where a stretched lobe is grazed, beyond
    # float32 (tests/test_effects.py::test_finite_at_corners).
    per = 1 / norm
    total = jnp.sum((g - d * (slope - d * bend)) * (ndf(sin2_m, cos2_m) * per * per), -1)
    return 2 * held * c2 * s2 * unmoved * total


def smith_lambda(ndf: NDF, cosine: Float[Array, "..."]) -> Float[Array, "..."]:
    """Lambda(theta) = 1/G1(theta) - 1 = N / n.v."""
    return averted_area(ndf, cosine) / cosine


def _both_areas(ndf: NDF, g: Geometry, rule: Rule | None) -> tuple[Float[Array, "..."], Float[Array, "..."]]:
    """N at light and viewer: through a table of polar angles where there is one and N costs more than to read it."""
    if getattr(ndf, "elementary", False):
        return averted_area(ndf, g.cos_i), averted_area(ndf, g.cos_o)
    return g.at_polar(lambda c: averted_area(ndf, c, rule))


def smith_correlated(ndf: NDF, g: Geometry, rule: Rule | None = None) -> Float[Array, "..."]:
    """G / (4 n.l n.v), height-correlated G = 1/(1 + Lambda(l) + Lambda(v)) (Heitz 2014, eq. 99)."""
    light, viewer = _both_areas(ndf, g, rule)
    return 0.25 / (g.cos_i * (g.cos_o + viewer) + g.cos_o * light)


def smith_separable(ndf: NDF, g: Geometry, rule: Rule | None = None) -> Float[Array, "..."]:
    """G / (4 n.l n.v), G = G1(l) G1(v)."""
    light, viewer = _both_areas(ndf, g, rule)
    return 0.25 / ((g.cos_i + light) * (g.cos_o + viewer))
