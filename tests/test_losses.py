"""Losses against their definitions, written out in plain numpy: residual, weight and the error of a table."""

from __future__ import annotations

import brdfit
import jax
import jax.numpy as jnp
import mpmath
import numpy as np
import pytest
from brdfit.data.synthetic import Floor, Grazing, Missing, Relative, generate
from brdfit.fitting.losses import LOSSES, named_loss
from brdfit.geometry import Geometry, from_directions
from numpy.typing import NDArray

Reals = NDArray[np.float64]

GRID = (30, 20, 24)
EPS = 0.003
"""A thousandth of the median of 3, for the loss ``relative``."""


def residual_and_weight(name: str, f: Reals, m: Reals, ci: Reals, co: Reals, eps: float) -> tuple[Reals, Reals]:
    """The definitions, f and m as [n, C], one row of the table each."""
    c, o = ci[:, None], co[:, None]
    one = np.ones_like(ci)
    log = np.log(1 + f * c) - np.log(1 + m * c)
    return {
        "log": (log, one),
        "low": (log, 1 / np.maximum(np.sin(np.arccos(co)), np.sin(np.radians(0.5)))),
        "bieron": (log, co),
        "ngan": ((f - m) * c, one),
        "cuberoot": (np.cbrt(f * c) - np.cbrt(m * c), one),
        "relative": ((f - m) / (m + eps), one),
        "perceptual": (np.cbrt(f * c * o) - np.cbrt(m * c * o), co),
    }[name]


def upper_half(n: int, seed: int) -> Reals:
    v = np.random.default_rng(seed).standard_normal((n, 3))
    v[:, 2] = np.abs(v[:, 2]) + 0.05
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def geometry(n: int) -> Geometry:
    wi, wo = upper_half(n, 1), upper_half(n, 2)
    wo[0] = [0, 0, 1]  # sin(theta_o) = 0, where the weight of ``low`` has its ceiling
    return from_directions(jnp.asarray(wi), jnp.asarray(wo))


def test_the_table_of_definitions_is_complete():
    assert set(LOSSES) == {"log", "low", "bieron", "ngan", "cuberoot", "relative", "perceptual"}


@pytest.mark.parametrize("name", LOSSES)
def test_against_the_definition(name):
    rng = np.random.default_rng(0)
    f, m = 10 ** rng.uniform(-6, 4, (2, 500, 3))
    m[:20] = 0  # black cells
    f[10:30] = 0
    with jax.enable_x64(True):
        g = geometry(500)
        loss = LOSSES[name].bind(np.full(9, 3.0))
        got = np.asarray(loss(jnp.asarray(f), jnp.asarray(m), g))
        weight = loss.weight(g)
        weight = np.ones(500) if weight is None else np.asarray(weight)
    want, relative = residual_and_weight(name, f, m, np.asarray(g.cos_i), np.asarray(g.cos_o), EPS)
    # the difference of two numbers of size s is good to 1e-15 s, the cube root by exp and log to 1e-14 s; in the definition
    # 1 + f c keeps the digits of f above 1e-16 only
    size = {"ngan": f + m, "relative": np.abs(want) + 1, "log": np.log1p(f) + np.log1p(m)}
    scale = size.get(name, size["log"] if name in ("low", "bieron") else np.cbrt(f) + np.cbrt(m))
    assert (np.abs(got - want) <= 2e-14 * scale + 3e-16).all()
    np.testing.assert_allclose(weight, relative, rtol=1e-12)


@pytest.mark.parametrize("measure", ["solid_angle", "cells"])
def test_error_of_a_table(measure):
    """sqrt(sum w r^2/sum w) over the fitted cells and all channels, on a table with noise, missing and masked cells."""
    noise = [Relative(0.1), Floor(0.003), Grazing(0.02), Missing(0.1)]
    table, _ = generate("abc-03", grid=GRID, noise=noise, seed=4)
    model = brdfit.model("ward", diffuse=[0.1, 0.2, 0.3], specular=[0.05, 0.1, 0.02], alpha=0.2)
    got = brdfit.evaluate(table, model, measure=measure, loss=lambda f, m, g: f - m)
    wi, wo = (v.reshape(-1, 3) for v in table.layout.directions())
    used = table.within(np.radians(80)).reshape(-1)
    with jax.enable_x64(True):
        f = np.asarray(model(wi[used], wo[used]))
    m = table.values.reshape(-1, 3)[used]
    share = np.broadcast_to(table.layout.solid_angle(), table.mask.shape).reshape(-1)[used]
    share = share if measure == "solid_angle" else np.ones(len(m))
    for name in LOSSES:
        r, relative = residual_and_weight(name, f, m, wi[used][:, 2], wo[used][:, 2], np.median(m) / 1000)
        w = (share * relative)[:, None] * np.ones((1, 3))
        # sums over 1e4 cells: 1e-12 by rounding
        assert got[name] == pytest.approx(np.sqrt((w * r**2).sum() / w.sum()), rel=1e-11), name
    w = share[:, None] * np.ones((1, 3))
    assert got["custom"] == pytest.approx(np.sqrt((w * (f - m) ** 2).sum() / w.sum()), rel=1e-11)


def test_cube_root_slope_is_finite_at_zero():
    with jax.enable_x64(True):
        g = geometry(1)
        for name in ("cuberoot", "perceptual"):
            loss = LOSSES[name]

            def at(f, loss=loss):
                return loss(jnp.full((1, 1), f), jnp.zeros((1, 1)), g)[0, 0]

            assert float(at(0.0)) == 0.0
            slope = float(jax.grad(at)(0.0))
            assert np.isfinite(slope)
            assert slope > 1e6  # steep, so that a black model is driven off a cell that is not black
            # at f cos = 1e-6 the guard of 1e-8 in the square of the root (1e-4) costs at most its share
            cosine = float(g.cos_i[0] if name == "cuberoot" else g.cos_i[0] * g.cos_o[0])
            x = 1e-6 / cosine
            assert float(jax.grad(at)(x)) == pytest.approx(cosine / 3 * 1e-6 ** (-2 / 3), rel=1.01e-4)


def test_log_does_not_cancel():
    """ln(1 + f c) - ln(1 + m c) of two logarithms loses all digits where f is close to m; one logarithm keeps them."""
    with jax.enable_x64(True), mpmath.workdps(50):
        g = geometry(1)
        c = mpmath.mpf(float(g.cos_i[0]))
        for m in (1e-9, 1e-3, 1.0, 1e6):
            for step in (1e-3, 1e-8, 1e-13, -1e-6, -1 + 1e-12, 1e12):
                f = m * (1 + step)
                got = float(LOSSES["log"](jnp.full((1, 1), f), jnp.full((1, 1), m), g)[0, 0])
                want = mpmath.log((1 + mpmath.mpf(f) * c) / (1 + mpmath.mpf(m) * c))
                # f - m is exact for f close to m (Sterbenz), what follows are a few rounded operations; far below a huge m
                # log1p of a number near -1 would have no digits left
                assert got == pytest.approx(float(want), rel=2e-15, abs=0)


def test_relative_has_a_floor():
    """eps is a thousandth of the median; where that is 0, of the median of what is not; never 0."""
    relative = LOSSES["relative"]
    assert relative.bind(np.array([1.0, 2.0, 9.0])).eps == 0.002  # type: ignore[attr-defined]
    assert relative.bind(np.array([0.0, 0.0, 0.0, 4.0])).eps == 0.004  # type: ignore[attr-defined]
    assert relative.bind(np.zeros(5)).eps > 0  # type: ignore[attr-defined]
    assert relative.bind(np.zeros(0)).eps > 0  # type: ignore[attr-defined]


def log_by_hand(f, m, g):
    c = g.cos_i[:, None]
    return jnp.log1p((f - m) * c / (1 + m * c))


def test_custom_loss_equals_the_built_in_of_the_same_formula():
    table, _ = generate("ward-00", grid=GRID, noise=[Relative(0.05), Floor(0.001)], seed=2)
    built_in = brdfit.fit(table, "ward", loss="log")
    custom = brdfit.fit(table, "ward", loss=log_by_hand)
    assert custom.loss == "log_by_hand"
    assert custom.errors["log_by_hand"] == pytest.approx(custom.errors["log"], rel=1e-12)
    assert custom.errors["log"] == pytest.approx(built_in.errors["log"], rel=1e-9)  # where both stop
    for name, value in built_in.parameters.items():
        # the cost is flat to 1e-9 of itself at the end: sqrt(1e-9 N) of a standard error with N = 2e4 residuals
        assert (np.abs(custom.parameters[name] - value) < 0.01 * built_in.stderr[name]).all()
        np.testing.assert_allclose(custom.stderr[name], built_in.stderr[name], rtol=1e-3)
        np.testing.assert_allclose(custom.spread[name], built_in.spread[name], rtol=1e-2)


def test_custom_loss_may_tie_channels_together():
    """A loss of the luminance alone: any number of residuals a cell."""

    def luminance(f, m, g):
        return (f - m).mean(-1) * g.cos_i

    table, truth = generate("ward-03", grid=GRID)
    fit = brdfit.fit(table, "ward", loss=luminance)
    assert fit.converged, fit.reason
    assert fit.errors["luminance"] < 1e-9
    # the mean of the channels is all that this loss sees
    assert np.mean(fit.parameters["diffuse"]) == pytest.approx(np.mean(truth["parameters"]["diffuse"]), rel=1e-6)  # type: ignore[index]
    assert fit.undetermined


@pytest.mark.parametrize(
    ("loss", "error", "text"),
    [
        ("lgo", ValueError, r"unknown loss 'lgo': choose from log, low, bieron.*or pass a function"),
        (3, TypeError, r"a loss is a name or a function .* not 3"),
    ],
)
def test_what_is_no_loss(loss, error, text):
    with pytest.raises(error, match=text):
        named_loss(loss)
