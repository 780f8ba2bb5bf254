"""Smith masking, exact for any isotropic distribution (Smith 1967; Heitz 2014, eq. 43 and 99)."""

from __future__ import annotations

from collections.abc import Callable

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...geometry import Geometry
from ...quadrature import smith_kernel

NODES = 170
REACH = 28.0
"""Range of u of the quadrature: ln(2 tan(theta)) is 10 at 89.995 degrees, and u - 10 = 18 holds densities that change
within e^-10 of the horizon. A density that needs less says so as ``smith_reach``, which sets the nodes closer."""

NDF = Callable[[Float[Array, "..."], Float[Array, "..."]], Float[Array, "..."]]


def smith_lambda(ndf: NDF, cosine: Float[Array, "..."]) -> Float[Array, "..."]:
    """Lambda(theta) = 1/G1(theta) - 1 of any isotropic ``ndf``, at cos(theta) in (0, 1].

    Projected area, int G1 D max(0, v.m) dm = n.v, with the azimuth of m integrated in closed form, leaves

        Lambda = 2 tan^2 theta int_0^(pi/2) D(m) sin^4(theta_m) (sin t - t cos t) sin t dt,  cot(theta_m) = tan(theta) cos t,

    every factor of which is positive: nothing cancels. With c = cos(theta), s = sin(theta),
    sin^2(theta_m) = c^2/(c^2 + s^2 cos^2 t), so that no tangent is formed and normal incidence is regular.

    Error of G1, up to 89.995 degrees: 1e-9 for GTR with alpha 1e-9..10 and gamma 0.01..1e7 (Gaussian lobes; 1e-15 for
    gamma < 10), 1e-9 for SGD with alpha 1e-7..30 and p -10..60 (tests/test_masking.py::test_against_the_projected_area).
    """
    cosine = jnp.asarray(cosine)
    rule = smith_kernel(NODES, getattr(ndf, "smith_reach", REACH))
    cos2_t, weight = (jnp.asarray(a, cosine.dtype) for a in rule)
    c2 = (cosine * cosine)[..., None]
    s2 = (1 - cosine)[..., None] * (1 + cosine)[..., None]
    norm = c2 + s2 * cos2_t
    sin2_m, cos2_m = c2 / norm, s2 * cos2_t / norm
    # Guard: at exactly normal incidence every m of the integral lies on the horizon, where D may divide by its cosine;
    # the factor s2 = 0 makes the value 0 (tests/test_masking.py::test_normal_incidence).
    cos2_m = jnp.where(cos2_m > 0, cos2_m, float(np.finfo(cosine.dtype).tiny) ** 0.25)
    return 2 * c2[..., 0] * s2[..., 0] * jnp.sum(weight * ndf(sin2_m, cos2_m) / norm**2, -1)


def smith_correlated(ndf: NDF, g: Geometry) -> Float[Array, "..."]:
    """Height-correlated G = 1/(1 + Lambda(l) + Lambda(v)) (Heitz 2014, eq. 99)."""
    light, viewer = g.at_polar(lambda c: smith_lambda(ndf, c))
    return 1 / (1 + light + viewer)


def smith_separable(ndf: NDF, g: Geometry) -> Float[Array, "..."]:
    """G = G1(l) G1(v)."""
    light, viewer = g.at_polar(lambda c: smith_lambda(ndf, c))
    return 1 / ((1 + light) * (1 + viewer))
