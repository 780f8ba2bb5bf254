"""Properties that every public model has, over the table of cases."""

from __future__ import annotations

import inspect
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from brdfit import models
from brdfit.geometry import from_directions
from brdfit.models import BRDF, MODELS, fresnel, parameters_of
from brdfit.stability import oracle

from . import cases
from .cases import TABLE, WI, WO, Row
from .empirical_cases import EMPIRICAL
from .microfacet_cases import MICROFACETS

rows = pytest.mark.parametrize("row", TABLE, ids=lambda r: r.name)


def evaluate(row: Row, wi: np.ndarray, wo: np.ndarray, dtype: type = np.float64) -> np.ndarray:
    """Values ``[cases, directions]`` in the given precision."""
    with jax.enable_x64(dtype is np.float64):
        stacked = jax.tree.map(jnp.asarray, row.stacked(dtype))
        f = jax.jit(jax.vmap(lambda m: m(wi.astype(dtype), wo.astype(dtype))[..., 0]))
        out = np.asarray(f(stacked))
        assert out.dtype == dtype
        return out


def slopes(row: Row, wi: np.ndarray, wo: np.ndarray, dtype: type = np.float64) -> dict[str, np.ndarray]:
    """Derivatives ``[cases, directions]`` by parameter and by component of the directions, named as the oracle does."""
    specs = parameters_of(row.model)

    def one(m: BRDF, wi: jax.Array, wo: jax.Array) -> jax.Array:
        return m(wi, wo)[0]

    with jax.enable_x64(dtype is np.float64):
        stacked = jax.tree.map(jnp.asarray, row.stacked(dtype))
        inner = jax.vmap(jax.grad(one, (0, 1, 2)), (None, 0, 0))
        by_model, by_wi, by_wo = jax.jit(jax.vmap(inner, (0, None, None)))(stacked, wi.astype(dtype), wo.astype(dtype))
    shape = (len(row.cases), len(wi))
    out = {p.name: np.asarray(getattr(by_model, p.name)).reshape(shape) for p in specs}
    for name, by in (("wi", by_wi), ("wo", by_wo)):
        out |= {f"{name}_{k}": np.asarray(by)[..., k] for k in range(3)}
    return out


def test_every_model_has_cases():
    assert {r.model for r in (*TABLE, *EMPIRICAL, *MICROFACETS)} == {v for variants in MODELS.values() for v in variants}
    assert {r.name for r in TABLE} == set(oracle.MODELS)
    for r in TABLE:
        for case in r.cases:
            models.build(r.model, dict(case))  # each lies where the formula is defined


def test_cases_are_many():
    """2,000 of each closed form and 500 of each model with a Smith integral, in value and derivative; corners included."""
    for r in TABLE:
        assert len(r.cases) * len(r.directions()[0]) >= (500 if r.few else 2000), r.name


def test_every_part_has_cases():
    functions = {n for n, f in vars(cases.ndf).items() if not n.startswith("_") and callable(f)}
    assert functions == set(cases.NDFS) | set(cases.ANISOTROPIC_NDFS)
    for package, names in cases.PARTS.items():
        assert {n for n, f in vars(package).items() if not n.startswith("_") and inspect.isfunction(f)} == names


@rows
def test_value(row: Row):
    """Against 40 digits on the very same numbers; the tolerance of each row is the one promised for it."""
    wi, wo = row.directions()
    got, want = evaluate(row, wi, wo), cases.expected(row.name)[0]
    # 1e-280: what is smaller has lost digits in products on the way, which is no error of the model
    error = np.abs(got - want) / (np.abs(want) + 1e-280)
    worst = np.unravel_index(np.nanargmax(error), error.shape)
    assert np.isfinite(got).all()
    assert error.max() <= row.tolerance, (error.max(), row.cases[worst[0]], wi[worst[1]], wo[worst[1]], want[worst])


@rows
def test_finite_derivatives(row: Row):
    """Of the first and second order, by every parameter and direction, at every corner: no NaN from an unused branch."""
    for name, slope in slopes(row, WI, WO).items():
        assert np.isfinite(slope).all(), name

    def one(m: BRDF, wi: jax.Array, wo: jax.Array) -> jax.Array:
        return m(wi, wo)[0]

    def along(*point: jax.Array) -> jax.Array:
        """Second derivatives summed over one argument: not finite if any of them is not."""
        return jax.jvp(jax.grad(one, (0, 1, 2)), point, jax.tree.map(jnp.ones_like, point))[1]

    few = np.r_[0:2, 12:26:4, 26, len(WI) - 5 : len(WI)]
    with jax.enable_x64(True):
        second = jax.jit(jax.vmap(jax.vmap(along, (None, 0, 0)), (0, None, None)))
        blocks = jax.tree.leaves(second(jax.tree.map(jnp.asarray, row.stacked()), WI[few], WO[few]))
    assert all(np.isfinite(b).all() for b in blocks)


@rows
def test_derivative(row: Row):
    """Against 40-digit difference quotients, to 1e-8 of the larger of the derivative and value/parameter."""
    wi, wo = row.directions()
    values, want = cases.expected(row.name)
    kink = np.abs(wi[:, 2] - wo[:, 2]) < 1e-6
    for name, slope in slopes(row, wi, wo).items():
        physical = name in row.cases[0]
        size = np.array([[abs(c.get(name, 1.0))] for c in row.cases])  # components of directions count as of size 1
        scale = np.where(size > 0, np.abs(values) / np.where(size > 0, size, 1), 0)
        # 1e-150: squares of what underflows next to the retro direction, where the oracle's step is not small
        error = np.abs(slope - want[name]) / (np.maximum(np.abs(want[name]), scale) + 1e-150)
        if row.kinked and not physical:
            error = np.where(kink, 0, error)
        w = np.unravel_index(np.argmax(error), error.shape)
        where = row.cases[w[0]], wi[w[1]], wo[w[1]]
        assert error[w] <= 1e-8, (name, error[w], slope[w], want[name][w], where)


@rows
def test_reciprocity(row: Row):
    """f(l, v) = f(v, l) to the rounding of exponents of up to 700."""
    there, back = evaluate(row, WI, WO), evaluate(row, WO, WI)
    np.testing.assert_allclose(there, back, rtol=1e-12, atol=1e-290)


@rows
def test_below_the_horizon(row: Row):
    """Zero with zero gradient where either direction is at or below the horizon."""
    up, level = np.array([0.6, 0.0, 0.8]), np.array([1.0, 0.0, 0.0])
    wi = np.stack([up, -up, -up, level, up, up * [1, 1, -1]])
    wo = np.stack([-up, up, -up, up, level, up * [1, 1, -1]])
    assert (evaluate(row, wi, wo) == 0).all()
    for name, slope in slopes(row, wi, wo).items():
        assert (slope == 0).all(), name


@rows
def test_single_precision(row: Row):
    """float32 on directions and parameters that float32 holds exactly, against float64; and finite in any case.

    1e-5 is promised of the sum of the terms (an SGD of negative Fresnel cancels the body term). Where a lobe has fallen to
    e^-E of its peak, about four roundings of 6e-8 each count E times: 3e-5 below 1e-12 of the peak. exp underflows at
    e^-87, and the factors on it reach 1e11: what is below 1e-25 need only be small.
    """
    stacked = row.stacked(np.float32)
    wi, wo = WI.astype(np.float32), WO.astype(np.float32)
    got = evaluate(row, wi, wo, np.float32).astype(float)
    with jax.enable_x64(True):
        exact = jax.tree.map(lambda x: jnp.asarray(x, np.float64), stacked)
        want = np.asarray(jax.jit(jax.vmap(lambda m: m(wi.astype(float), wo.astype(float))[..., 0]))(exact))
    assert np.isfinite(got).all()
    body = np.array([c["diffuse"] / np.pi for c in row.cases])[:, None]
    error = np.abs(got - want) / (np.maximum(np.abs(want), body) + 1e-23)
    tolerance = np.where(want > 1e-12 * want.max(1, keepdims=True), 1e-5, 3e-5)
    worst = np.unravel_index(np.argmax(error / tolerance), error.shape)
    assert (error <= tolerance).all(), (error[worst], row.cases[worst[0]], wi[worst[1]], wo[worst[1]], want[worst])
    # The slope of a density D by sin^2 is about pi D^2 at its peak, which float32 cannot hold from D = 1e19 on.
    holds = want.max(1) < 1e14
    for name, slope in slopes(row, WI, WO, np.float32).items():
        assert np.isfinite(slope[holds]).all(), name


@rows
def test_eager_is_jit_is_vmap(row: Row):
    """One program compiled, run operation by operation, or mapped over directions: the same but for fused roundings."""
    wi, wo = WI[::16], WO[::16]
    for case in row.cases[:1]:
        with jax.enable_x64(True):
            m = models.build(row.model, dict(case))
            eager = np.asarray(m(wi, wo))
            mapped = np.asarray(jax.vmap(m)(wi, wo))
            loop = np.stack([np.asarray(m(a, b)) for a, b in zip(wi, wo, strict=True)])
            compiled = np.asarray(jax.jit(lambda m, a, b: m(a, b))(m, wi, wo))
        assert eager.shape == (len(wi), 3)
        for other in (mapped, loop, compiled):
            np.testing.assert_allclose(other, eager, rtol=1e-12, atol=1e-290)


@pytest.mark.parametrize("name", [n for n, v in MODELS.items() if len(v) > 1])
def test_anisotropic_with_equal_widths(name: str):
    """Equals the isotropic form, to the rounding of exponents of up to 700."""
    round_row, long_row = (next(r for r in (*TABLE, *MICROFACETS) if r.model is v) for v in MODELS[name])
    rounds, longs = ({p.name for p in parameters_of(r.model)} for r in (round_row, long_row))
    if longs > rounds:  # a parameter that stretches the lobe
        (stretch,) = longs - rounds
        split = [{**c, stretch: 0.0} for c in round_row.cases]
    else:
        (width,) = rounds - longs
        split = [
            {**{k: v for k, v in c.items() if k != width}, f"{width}_x": c[width], f"{width}_y": c[width]}
            for c in round_row.cases
        ]
    same = Row(long_row.model, tuple(split), 0)
    np.testing.assert_allclose(evaluate(same, WI, WO), evaluate(round_row, WI, WO), rtol=1e-12, atol=1e-290)


def test_absent_effects_cost_nothing():
    """The program of a model holds the operations of its formula and no others."""
    with jax.enable_x64(True):
        g = from_directions(WI, WO)

        def program(m: BRDF) -> str:
            return str(jax.make_jaxpr(lambda m: m.evaluate(g))(m))

        scalar = {r.name: jax.tree.map(lambda x: jnp.asarray(x).reshape(-1)[0], r.stacked()) for r in TABLE}
        by_hand = str(jax.make_jaxpr(lambda m: m.diffuse / jnp.pi)(scalar["Lambert"]))
        assert program(scalar["Lambert"]) == by_hand
        w = scalar["Ward"]

        def ward(m: BRDF) -> jax.Array:
            tan2 = g.sin2_h / (g.cos_h * g.cos_h)
            d = jnp.exp(-tan2 / m.alpha**2) / (jnp.pi * m.alpha**2)
            return m.diffuse / jnp.pi + m.specular * (d / (4 * jnp.sqrt(g.cos_i * g.cos_o)))

        assert program(w) == str(jax.make_jaxpr(ward)(w))


@pytest.mark.parametrize("ior", [1.0, 1 + 1e-12, 1.001, 1.5, 100.0, 1001.0])
def test_fresnel(ior: float):
    """Cook's form as printed, in 40 digits; F0 at normal incidence, and 1 towards grazing. Schlick's two at both ends."""
    with jax.enable_x64(True):
        g = from_directions(WI, WO)
        got = np.asarray(fresnel.dielectric(jnp.asarray(ior), g))
        ends = from_directions(np.array([[0, 0, 1.0], [1.0, 0, 1e-9]]), np.array([[0, 0, 1.0], [-1.0, 0, 1e-9]]))
        f0 = float(fresnel.dielectric_f0(jnp.asarray(ior)))
        np.testing.assert_allclose(fresnel.schlick(jnp.asarray(f0), ends), [f0, 1], rtol=1e-8)  # 5 (1e-9) below 1
        sgd = fresnel.sgd_fresnel(jnp.asarray(f0), jnp.asarray(0.3), ends)
        np.testing.assert_allclose(sgd, [f0 - 0.3, 1], rtol=1e-8)
        np.testing.assert_allclose(fresnel.dielectric(jnp.asarray(ior), ends)[0], f0, rtol=1e-13)
    with oracle.mp.workdps(oracle.DIGITS):
        n, want = oracle.mpf(ior), []
        for c in np.asarray(g.cos_d):
            c = oracle.mpf(float(c))
            root = oracle.mp.sqrt(n**2 + c**2 - 1)
            ratio = (c * (root + c) - 1) / (c * (root - c) + 1)
            want.append(float((root - c) ** 2 / (root + c) ** 2 / 2 * (1 + ratio**2)))
    np.testing.assert_allclose(got, want, rtol=1e-13)  # ten roundings, four of them counted twice by squares


def test_smith_oracle_is_the_integral_as_written():
    """The panels of the oracle, and its derivatives, against adaptive quadrature over theta_m of the formula as MODELS.md
    prints it, and differences of that.
    """
    mp = oracle.mp

    def area(alpha: Any, gamma: Any, cosine: Any) -> Any:
        view = mp.acos(cosine)

        def integrand(theta: Any) -> Any:
            if theta + view <= mp.pi / 2:
                azimuth = 2 * mp.pi * mp.cos(view) * mp.cos(theta)
            else:
                phi0 = mp.acos(-mp.cot(view) * mp.cot(theta))
                azimuth = 2 * (phi0 * mp.cos(view) * mp.cos(theta) + mp.sin(view) * mp.sin(theta) * mp.sin(phi0))
            return oracle.gtr(alpha, gamma, mp.cos(theta)) * azimuth * mp.sin(theta)

        return mp.quad(integrand, [0, mp.pi / 2 - view, mp.pi / 2])

    point = [oracle.mpf(x) for x in (0.3, 1.7, 0.34)]
    with mp.workdps(20):
        value, *slopes = oracle.projected_area(oracle.gtr, *point)
        # 4e-11 is what the oracle leaves out at either end
        assert float(value / area(*point)) == pytest.approx(1, rel=1e-10)
        assert float(oracle.gtr_masking(*point) * value / point[2]) == pytest.approx(1, rel=1e-15)
        step = oracle.mpf("1e-6")  # whose square is what the quotient errs by, a few times
        for k, slope in enumerate(slopes):
            high, low = (area(*(x + s * (k == n) for n, x in enumerate(point))) for s in (step, -step))
            assert float(slope / ((high - low) / (2 * step))) == pytest.approx(1, rel=2e-10)
