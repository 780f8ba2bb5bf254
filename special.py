"""Functions with removable singularities, right to the last digits on both sides of them.

Each is written so that value, gradient and Hessian are finite and accurate at the singular point. A ``where``
chooses between two forms; the *input* of the form that is not chosen is replaced by a harmless one, because a
derivative through an unused branch that overflows is 0 * inf = NaN.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

Scalars = Float[Array, "..."]

# Taylor coefficients 1/(k+1)! of expm1(x)/x; at |x| <= 1 the first one left out is below 1e-19.
_PHI1 = tuple(1.0 / math.factorial(k + 1) for k in range(20))


def expm1_ratio(x: ArrayLike) -> Scalars:
    """(e^x - 1)/x, equal to 1 at x = 0.

    Domain: every real x below the overflow of e^x. Relative error below 4 ulp. The series serves |x| < 1 so that the
    first and second derivative do not cancel either (tests/test_special.py::test_expm1_ratio_derivatives).
    """
    x = jnp.asarray(x)
    small = jnp.abs(x) < 1
    near = jnp.where(small, x, 0.0)  # guard: overflow of the series (tests/test_special.py::test_expm1_ratio_far_out)
    series = jnp.full_like(near, _PHI1[-1])
    for coefficient in reversed(_PHI1[:-1]):
        series = series * near + coefficient
    far = jnp.where(small, 1.0, x)  # guard: 0/0, and in the derivative (tests/test_special.py::test_expm1_ratio_derivatives)
    return jnp.where(small, series, jnp.expm1(far) / far)


def log1p_series(x: Scalars) -> Scalars:
    """ln(1 + x)/x for |x| <= 0.1 as 2 artanh(z)/x, z = x/(2 + x): terms fall by 361 each, the first left out is 1e-19."""
    z2 = (x / (2 + x)) ** 2
    series = jnp.full_like(z2, 1 / 13)
    for k in range(5, -1, -1):
        series = series * z2 + 1.0 / (2 * k + 1)
    return 2 / (2 + x) * series


def log1p_ratio(x: ArrayLike) -> Scalars:
    """ln(1 + x)/x for x > -1, equal to 1 at x = 0.

    Relative error below 4 ulp. The series serves |x| < 0.1.
    """
    x = jnp.asarray(x)
    small = jnp.abs(x) < 0.1
    far = jnp.where(small, 1.0, x)  # guard: 0/0 (tests/test_special.py::test_log1p_ratio_derivatives)
    return jnp.where(small, log1p_series(x), jnp.log1p(far) / far)


def root(square: Scalars) -> Scalars:
    """The root of a square, not below the eighth root of the smallest number of its precision.

    Guard: the root has no derivative at 0, and quotients of sines and angles are 0/0 there; the eighth power, as in
    derivatives of products of quotients, can still be divided by (tests/test_models.py::test_finite).
    """
    return jnp.sqrt(jnp.maximum(square, float(np.finfo(square.dtype).tiny) ** 0.25))


def sine(cosine: Scalars) -> Scalars:
    """sin(theta) of cos(theta) in [0, 1], never quite 0: see :func:`root`."""
    return root((1 - cosine) * (1 + cosine))


@jax.custom_jvp
def lambert_w(x: ArrayLike) -> Scalars:
    """W with W e^W = x, for x >= 0, by Newton's method on W + ln W = ln x; relative error below 1e-13."""
    x = jnp.asarray(x)
    tiny = float(np.finfo(x.dtype).tiny)
    right = jnp.log(jnp.maximum(x, tiny))
    w = jnp.where(right > 1, right - jnp.log(jnp.maximum(right, 1)), x / (1 + x))
    for _ in range(6):
        w = jnp.maximum(w * (1 + right - jnp.log(jnp.maximum(w, tiny))) / (1 + w), 0)
    return w


@lambert_w.defjvp
def _lambert_w_slope(point: tuple[Scalars], tangent: tuple[Scalars]) -> tuple[Scalars, Scalars]:
    w = lambert_w(point[0])
    return w, jnp.exp(-w) / (1 + w) * tangent[0]


SLOPE_LIMIT = 1e37
"""Largest derivative of a model in float32, which ends at 3e38: a few of them can be added."""


def hold_slopes(f: Callable[..., Scalars], *arguments: ArrayLike) -> Scalars:
    """``f(*arguments)``, elementwise, in float32, with derivatives held within +-``SLOPE_LIMIT``; values are untouched.

    The slope of a lobe of height D by sin^2(theta_h) is about D^2, beyond float32 from D = 1e19 on. Backwards through the
    chain it meets the 0 of d sin^2/dh at the mirror direction, and inf * 0 = NaN, although their product is in range. So
    slopes are taken forwards, one argument at a time, where the small factor comes first, and what is then still out
    of range is held there: with its sign, and large (tests/test_stability.py::test_slopes_are_held).
    """
    held = jax.custom_jvp(f)

    @held.defjvp
    def _(point: tuple[Scalars, ...], tangent: tuple[Scalars, ...]) -> tuple[Scalars, Scalars]:
        def slope(move: Scalars) -> Scalars:
            along: Array = jax.jvp(f, point, tuple(jnp.full_like(x, m) for x, m in zip(point, move, strict=True)))[1]
            return along

        slopes = jax.vmap(slope)(jnp.eye(len(point), dtype=jnp.float32))
        # Guard: inf times a tangent of 0 (tests/test_stability.py::test_slopes_are_held).
        slopes = jnp.clip(slopes, -SLOPE_LIMIT, SLOPE_LIMIT)
        return f(*point), sum((s * t for s, t in zip(slopes, tangent, strict=True)), jnp.zeros((), jnp.float32))

    value: Array = held(*(jnp.asarray(x, jnp.float32) for x in arguments))
    return value
