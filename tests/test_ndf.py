"""Normal distributions: normalisation, the ends of their range, and the agreement of their forms."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import mpmath
import numpy as np
import pytest
from brdfit.models import ndf

from . import cases

CASES = [(name, parameters) for name, (_, sets) in cases.NDFS.items() for parameters in sets]


def density(name: str, parameters: tuple[float, ...]) -> Callable[[Any, Any], Any]:
    """D(sin^2, cos^2) of any of the forms that the package has."""
    values = [jnp.asarray(p) for p in parameters]
    if name == "power_cosine":
        return lambda sin2, cos2: ndf.power_cosine(sin2, cos2, *values)
    if name == "gaussian":
        return lambda sin2, cos2: ndf.gaussian(sin2 / cos2, *values)
    return cases.NDFS[name][0](*values)


def rule() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """sin^2, cos^2 and weights of the integral over directions, in x = ln tan(theta) by the trapezoidal rule.

    All densities are analytic in x within pi/4 of the real axis (Gaussian ones; others pi/2): its error is
    exp(-2 pi (pi/4)/step), 1e-42 for a step of 0.05. e^-40 of the mass is left out on either side.
    """
    x = np.arange(-45, 45, 0.05)
    t2 = np.exp(2 * x)
    sin2, cos2 = t2 / (1 + t2), 1 / (1 + t2)
    return sin2, cos2, 0.05 * 2 * np.pi * sin2 * np.sqrt(cos2)  # sin dtheta = sin^2 cos dx


@pytest.mark.parametrize(("name", "parameters"), CASES)
def test_normalisation(name: str, parameters: tuple[float, ...]):
    """The integral of D cos is 1. That of D alone for (e + 1)/(2 pi) cos^e, a density of half vectors, and that of
    D/cos^3 for Ward's lobe, a density of slopes.
    """
    sin2, cos2, weight = rule()
    with jax.enable_x64(True):
        d = np.asarray(density(name, parameters)(jnp.asarray(sin2), jnp.asarray(cos2)))
    power = {"power_cosine": 0, "gaussian": -3}.get(name, 1)
    # 1e-13: 1800 terms of one sign, each rounded in an exponent of up to 30 where it counts; ABC depends on 1 - cos with
    # singularities nearer to the real axis for small b, worth 1e-12
    assert np.sum(weight * np.sqrt(cos2) ** power * d) == pytest.approx(1, rel=2e-12)


@pytest.mark.parametrize(("name", "parameters"), CASES)
def test_finite_at_both_ends(name: str, parameters: tuple[float, ...]):
    """D and its derivatives at the pole, and next to and on the horizon, in both precisions."""
    for dtype, gap in ((np.float64, 1e-18), (np.float32, 1e-12)):
        with jax.enable_x64(dtype is np.float64):
            values = jnp.asarray(parameters, dtype)
            # not all are defined on the horizon
            on_horizon = [(1.0, 0.0)] if name not in ("ABC", "power_cosine", "gaussian") else []
            both = jax.jit(jax.value_and_grad(lambda v, e: density(name, tuple(v))(e[0], e[1]), (0, 1)))
            for sin2, cos2 in [(0.0, 1.0), (gap, 1.0), (1.0, gap), *on_horizon]:
                value, slopes = both(values, jnp.asarray([sin2, cos2], dtype))
                assert np.isfinite(value)
                assert all(np.isfinite(a).all() for a in slopes)


@pytest.mark.parametrize(("alpha", "p"), [(1e-7, -10.0), (1e-7, 60.0), (0.05, 0.6), (30.0, -10.0), (30.0, 60.0)])
def test_sgd_at_the_horizon(alpha: float, p: float):
    """0 with zero derivatives of the first and second order: x overflows where exp(-x) has long been 0."""
    with jax.enable_x64(True):
        f = lambda v: ndf.SGD(v[0], v[1])(v[2], v[3])  # noqa: E731
        for cos2 in (0.0, 1e-300, 1e-150, 1e-40, 1e-12):
            v = jnp.array([alpha, p, 1.0, cos2])
            assert f(v) == 0
            assert (jax.grad(f)(v) == 0).all()
            assert (jax.hessian(f)(v) == 0).all()


def test_sgd_slopes_in_single_precision():
    """In the tail of a narrow lobe, where the product of exp and the slope of its divisor is below float32."""
    points = np.array([[1e-7, 2.0, 3.7e-12], [1e-7, 9.83, 1.47e-11], [1e-7, 31.0, 1e-13]], np.float32)

    def slopes(dtype: type) -> np.ndarray:
        with jax.enable_x64(dtype is np.float64):
            f = jax.jacfwd(lambda v: ndf.SGD(v[0], v[1])(v[2], 1 - v[2]))
            return np.asarray(jax.vmap(f)(jnp.asarray(points.astype(dtype))), float)

    want = slopes(np.float64)
    # 1e-5 is promised where one rounding of an argument counts less than 50 times; here sin^2/alpha^2 counts 1500 times
    np.testing.assert_allclose(slopes(np.float32), want, rtol=1e-3)


@pytest.mark.parametrize("density", [ndf.GTR, ndf.SGD])
def test_tails_in_single_precision(density: type):
    """e^-110 of a peak of 3e14 is a value that float32 holds, though e^-110 is not."""
    point = np.array([1e-7, 10.0, 6e-10], np.float32)

    def value(dtype: type) -> float:
        with jax.enable_x64(dtype is np.float64):
            v = jnp.asarray(point.astype(dtype))
            return float(density(v[0], v[1])(v[2], 1 - v[2]))

    want = value(np.float64)
    assert 1e-35 < want < 1e-32
    # half an ulp of an exponent of 110 is 4e-6, of which a few
    assert value(np.float32) == pytest.approx(want, rel=1e-4, abs=0)


def test_power_cosine_at_both_ends():
    """Gradient and Hessian are finite where sin^2 is 0 and where it rounds to 1, and the power is right beside them."""
    with jax.enable_x64(True):
        f = lambda v: ndf.power_cosine(v[0], v[1], v[2])  # noqa: E731
        for sin2, cos2 in ((0.0, 1.0), (1.0, 1e-20), (0.5, 0.5), (1e-30, 1.0)):
            v = jnp.array([sin2, cos2, 3.0])
            np.testing.assert_allclose(f(v), 4 / (2 * np.pi) * cos2**1.5, rtol=1e-14)  # cos^3 of the cos^2 given
            assert np.isfinite(jax.grad(f)(v)).all()
            assert np.isfinite(jax.hessian(f)(v)).all()


def test_power_cosine_anisotropic_at_the_pole():
    """Value (ex + 1)/(2 pi) for equal exponents, and -sqrt((ex+1)(ey+1))/(2 pi) ex/2 as the slope by x^2."""
    with jax.enable_x64(True):
        f = lambda x2: ndf.power_cosine_anisotropic(x2, jnp.asarray(0.0), 1 - x2, jnp.asarray(3.0), jnp.asarray(8.0))  # noqa: E731
        for x2 in (0.0, 1e-30):
            assert f(x2) == pytest.approx(6 / (2 * np.pi), rel=1e-15)
            assert jax.grad(f)(x2) == pytest.approx(-6 / (2 * np.pi) * 1.5, rel=1e-15)
            # ln(cos)/sin^2 = -1/2 - sin^2/4: half of the square of the slope's factor, less ex/2
            assert jax.grad(jax.grad(f))(x2) == pytest.approx(6 / (2 * np.pi) * (1.5**2 - 3 / 2), rel=1e-14)


@pytest.mark.parametrize("name", cases.ANISOTROPIC_NDFS)
def test_equal_widths(name: str):
    """The anisotropic form equals the isotropic one, to the rounding of exponents of up to 700."""
    x2, y2 = np.random.default_rng(5).random((2, 50)) / 2
    sin2, cos2 = x2 + y2, 1 - x2 - y2
    with jax.enable_x64(True):
        for (width,) in cases.NDFS[cases.ANISOTROPIC_NDFS[name]][1]:
            if name == "power_cosine_anisotropic":
                long, round_ = ndf.power_cosine_anisotropic(x2, y2, cos2, width, width), ndf.power_cosine(sin2, cos2, width)
            else:
                long, round_ = ndf.anisotropic_gaussian(x2 / cos2, y2 / cos2, width, width), ndf.gaussian(sin2 / cos2, width)
            np.testing.assert_allclose(long, round_, rtol=1e-12, atol=1e-290)


def test_limits_of_gtr():
    """alpha -> 0: a power of the sine. gamma -> infinity at gamma (1/alpha^2 - 1) = K: exp(-K sin^2)."""
    sin2 = np.array([0.01, 0.2, 0.7])
    with jax.enable_x64(True):
        power = ndf.GTR(jnp.asarray(1e-9), jnp.asarray(1.3))(sin2, 1 - sin2)
        # relative to the limit the base has alpha^2 cot^2 = 1e-16
        np.testing.assert_allclose(power / power[0], (sin2 / sin2[0]) ** -1.3, rtol=1e-13)
        k, gamma = 5.0, 1e7
        lobe = ndf.GTR(jnp.asarray((1 + k / gamma) ** -0.5), jnp.asarray(gamma))(sin2, 1 - sin2)
    # k^2/gamma sin^4/2, the next term of gamma ln(1 + k sin^2/gamma), and alpha rounded: eps gamma = 2e-9
    np.testing.assert_allclose(lobe / lobe[0], np.exp(-k * (sin2 - sin2[0])), rtol=2e-6)


def share_of_gtr(alpha: float, gamma: float, sin2: float, cos2: float) -> list[float]:
    """int D cos over the cap, and over the rest: of (1 + (alpha^2 - 1) t)^-gamma over t = cos^2 (Burley 2012, eq. 4)."""
    with mpmath.workdps(60):
        slope, power = mpmath.mpf(alpha) ** 2 - 1, 1 - mpmath.mpf(gamma)
        t = 1 - mpmath.mpf(sin2) if sin2 < cos2 else mpmath.mpf(cos2)
        below, here, above = (1 + slope * x for x in (mpmath.mpf(0), t, mpmath.mpf(1)))
        if slope == 0:
            below, here, above = mpmath.mpf(0), t, mpmath.mpf(1)
        else:
            below, here, above = (mpmath.log(x) if power == 0 else x**power for x in (below, here, above))
        return [float((above - here) / (above - below)), float((here - below) / (above - below))]


GTR_SHARES = np.array([*cases.NDFS["GTR"][1], (1e-4, 4.0), (1e-7, 1.05)])


def test_shares_of_gtr():
    """Against 60 digits: a share of 1e-16 around the pole of a narrow lobe, or the horizon of one that grows towards it, to
    1e-12 of itself, and all to 1e-14 of the whole. The quantile leads back to the sin^2 and cos^2, to 1e-12.
    """
    sin2, cos2, _ = (a[500:1300:50] for a in rule())
    want = np.array([[share_of_gtr(*p, *x) for x in zip(sin2, cos2, strict=True)] for p in GTR_SHARES.tolist()])

    @jax.jit
    @jax.vmap
    def both(p: Any) -> Any:
        lobe = ndf.GTR(p[0], p[1])
        shares = lobe.cumulative(jnp.asarray(sin2), jnp.asarray(cos2))
        return jnp.stack(shares, -1), jnp.stack(lobe.quantile(*shares), -1)

    with jax.enable_x64(True):
        shares, back = both(jnp.asarray(GTR_SHARES))
    for got, expected, (alpha, _) in zip(np.asarray(shares), want, GTR_SHARES, strict=True):
        peak = int(alpha > 1)
        np.testing.assert_allclose(got[:, peak], expected[:, peak], rtol=1e-12)
    np.testing.assert_allclose(shares, want, rtol=0, atol=1e-14)
    np.testing.assert_allclose(back, np.broadcast_to(np.stack([sin2, cos2], -1), back.shape), rtol=0, atol=1e-12)


def test_quantiles_of_gtr_at_both_ends():
    """Finite, with finite derivatives, wherever next to nothing of the lobe is left on either side."""
    ends = np.array([(0.0, 1.0), (1e-30, 1.0), (0.5, 0.5), (1.0, 1e-12), (1.0, 1e-30), (1.0, 0.0)])
    for dtype in (np.float64, np.float32):
        with jax.enable_x64(dtype is np.float64):
            slopes = jax.jacrev(lambda p, s: jnp.stack(ndf.GTR(p[0], p[1]).quantile(s[0], s[1])), (0, 1))
            over = jax.jit(jax.vmap(jax.vmap(slopes, (None, 0)), (0, None)))
            assert all(np.isfinite(a).all() for a in over(jnp.asarray(GTR_SHARES, dtype), jnp.asarray(ends, dtype)))
