"""Functions with removable singularities, at them and on both sides, in value and in two derivatives."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from brdfit.special import expm1_ratio, lambert_w, log1p_ratio, sine
from mpmath import mp, mpf

NEAR = np.concatenate([[0.0], *([s * 10.0**e for s in (1, -1)] for e in (-300.0, -15.0, -12.0, -8.0, -5.0, -3.0, -1.5))])


def derivatives(f: Callable[[Any], Any], x: np.ndarray) -> list[np.ndarray]:
    """Value, first and second derivative in float64."""
    with jax.enable_x64(True):
        orders = (f, jax.grad(f), jax.grad(jax.grad(f)))
        return [np.asarray(jax.vmap(g)(jnp.asarray(x))) for g in orders]


def oracle(f: Callable[[Any], Any], at_zero: tuple[Any, ...], x: np.ndarray) -> list[np.ndarray]:
    """The same with 120 digits by Taylor coefficients of the quotient, whose limits at 0 are given."""
    with mp.workdps(120):
        rows = []
        for a in x:
            if abs(a) < 1e-30:  # the next term is below 1e-30 of this one
                rows.append([float(v) for v in at_zero])
            else:
                rows.append([float(mp.diff(f, mpf(float(a)), n)) for n in range(3)])
    return [np.array(column) for column in zip(*rows, strict=True)]


# 4 ulp for the value is promised; outside the series derivatives cancel 1/x and 1/x^2, x from 0.1 on: 10 and 100 each.
ULPS = (4, 4 * 10, 4 * 100)


def close(got: list[np.ndarray], want: list[np.ndarray]) -> None:
    for order, (g, w, ulps) in enumerate(zip(got, want, ULPS, strict=True)):
        error = np.abs(g - w) / np.abs(w) / np.finfo(float).eps
        assert error.max() <= ulps, (order, error.argmax(), error.max())


def test_expm1_ratio_derivatives():
    x = np.concatenate([NEAR, [0.3, -0.3, 0.999999, 1.000001, -0.999999, -1.000001, 5.0, -5.0, 41.0, -700.0]])
    close(derivatives(expm1_ratio, x), oracle(lambda t: mp.expm1(t) / t, (1, mpf(1) / 2, mpf(1) / 3), x))


def test_expm1_ratio_far_out():
    """Beyond (1 - gamma) M of the steepest GTR, where the series overflows, and up to the overflow of exp."""
    value, first, second = derivatives(expm1_ratio, np.array([-1e18, -1e9, 700.0]))
    np.testing.assert_allclose(value, [1e-18, 1e-9, float(mp.expm1(700) / 700)], rtol=1e-12)
    assert np.isfinite(first).all()
    assert np.isfinite(second).all()
    # (1 - gamma) M of gamma 1e7 and alpha 1e-9, whose 19th power is beyond float32
    assert jax.grad(expm1_ratio)(jnp.float32(-4e8)) == pytest.approx(4e8**-2, rel=1e-6)


def test_log1p_ratio_derivatives():
    x = np.concatenate([NEAR, [0.0999999, 0.1000001, -0.0999999, -0.1000001, 0.7, -0.5, 30.0]])
    close(derivatives(log1p_ratio, x), oracle(lambda t: mp.log1p(t) / t, (1, -mpf(1) / 2, mpf(2) / 3), x))


@pytest.mark.parametrize("f", [expm1_ratio, log1p_ratio])
def test_single_precision(f: Callable[[Any], Any]):
    x = np.array([0, 1e-7, -1e-7, 1e-3, -0.05, 0.11, -0.4, 0.9, 3.0], np.float32)
    got = np.asarray(f(x))
    assert got.dtype == np.float32
    np.testing.assert_allclose(got, derivatives(f, x.astype(float))[0], rtol=4 * np.finfo(np.float32).eps)
    assert np.isfinite(np.asarray(jax.vmap(jax.grad(jax.grad(f)))(jnp.asarray(x)))).all()


def test_lambert_w():
    """W and its two derivatives from 0 to where e^W would overflow."""
    x = np.array([1e-250, 1e-30, 1e-12, 1e-3, 0.3, 1.0, 2.7, 10.0, 1e4, 1e30, 1e250])
    w = [mp.lambertw(mpf(float(t))).real for t in x]
    slope = [mp.exp(-y) / (1 + y) for y in w]
    bend = [-mp.exp(-2 * y) * (2 + y) / (1 + y) ** 3 for y in w]
    for got, want in zip(derivatives(lambert_w, x), (w, slope, bend), strict=True):
        np.testing.assert_allclose(got, [float(y) for y in want], rtol=1e-12, atol=1e-300)
    value, first, second = derivatives(lambert_w, np.zeros(1))
    assert (value[0], first[0]) == (0, 1)
    assert np.isfinite(second[0])


def test_sine():
    """The sine of a cosine, and no infinite derivative where the sine is 0."""
    value, first, second = derivatives(sine, np.array([0.0, 0.6, 1 - 1e-12, 1.0]))
    np.testing.assert_allclose(value[:2], [1, 0.8], rtol=1e-15)
    assert value[2] == pytest.approx(1.414213562e-6, rel=1e-4)  # 1 - 1e-12 is a rounding of 1e-16 off
    assert value[3] > 0
    assert np.isfinite(first).all()
    assert np.isfinite(second).all()
