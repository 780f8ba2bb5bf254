"""Properties that every public model has, over the table of cases: one program a model and precision."""

from __future__ import annotations

import inspect
from functools import cache
from typing import Any

import brdfit
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from brdfit import models
from brdfit.geometry import from_directions
from brdfit.models import BRDF, MODELS, blocks, fresnel, parameters_of
from brdfit.models.lafortune import lobes
from brdfit.physics import hemisphere
from brdfit.stability import measure, oracle, reference
from brdfit.stability.parts import PARTS

from . import cases
from .cases import TABLE, WI, WO, Row

rows = pytest.mark.parametrize("row", TABLE, ids=lambda r: r.name)
pytestmark = pytest.mark.usefixtures("quickly")

UP, LEVEL = np.array([0.6, 0.0, 0.8]), np.array([1.0, 0.0, 0.0])
BELOW = [(UP, -UP), (-UP, UP), (-UP, -UP), (LEVEL, UP), (UP, LEVEL), (UP * [1, 1, -1], UP * [1, 1, -1])]
N = len(WI)
ALL = np.concatenate([WI, WO, [a for a, _ in BELOW]]), np.concatenate([WO, WI, [b for _, b in BELOW]])
"""The directions, the same exchanged, and pairs below the horizon."""


@cache
def found(row: Row, dtype: type = np.float64) -> tuple[np.ndarray, np.ndarray]:
    """Values ``[cases, directions]`` and derivatives ``[cases, directions, arguments]`` at ``ALL``."""
    points = row.points(*ALL)
    value, slopes = measure.evaluate(row.part, points.reshape(-1, points.shape[-1]), dtype)
    return value.reshape(points.shape[:2]), slopes.reshape(points.shape)


def at(row: Row) -> Any:
    """Which of ``ALL`` are the directions of the row."""
    return cases.FEW if row.few else np.arange(N)


def test_every_model_has_cases():
    classes = {v for variants in MODELS.values() for v in variants}
    assert {r.model for r in TABLE} == classes
    assert {p.name for p in PARTS if p.group == "models"} == {c.__name__ for c in classes}
    for r in TABLE:
        for case in r.cases:
            models.build(r.model, dict(case))  # each lies where the formula is defined
        for p in parameters_of(r.model):  # and so does what a fit searches
            assert all(end in p.valid or np.isinf(end) for end in p.search), p


def test_cases_are_many():
    """2,000 of the closed forms that are fitted by default, in value and derivative, and 500 of each other model."""
    for r in TABLE:
        many = r.thorough and not r.few
        assert len(r.cases) * len(r.directions()[0]) >= (2000 if many else 500), r.name


def test_every_part_has_cases():
    functions = {n for n, f in vars(cases.ndf).items() if not n.startswith("_") and callable(f)}
    assert functions == set(cases.NDFS) | set(cases.ANISOTROPIC_NDFS)
    names = {p.name for p in PARTS}
    for package, parts in cases.COVERED.items():
        public = {
            n for n, f in vars(package).items() if (not n.startswith("_") and inspect.isfunction(f)) or inspect.isclass(f)
        }
        assert public == set(parts)
        assert set(parts.values()) <= names
    assert {*blocks.NDFS, *(f"Smith, {n}" for n in blocks.NDFS), *blocks.FRESNELS} <= names
    assert set(blocks.MASKINGS) <= {n.removesuffix(", ggx") for n in names}


def compare(row: Row, got: tuple[np.ndarray, np.ndarray], want: tuple[np.ndarray, np.ndarray], points: np.ndarray) -> None:
    """Values to the row's tolerance, slopes to 1e-8 of the larger of the derivative and value/parameter."""
    value, slope = measure.errors(row.part, points, got, want, np.float64)
    k = int(np.argmax(value))
    assert value[k] <= row.tolerance, (
        value[k],
        dict(zip(row.part.arguments, points[k], strict=True)),
        got[0][k],
        want[0][k],
    )
    k, n = np.unravel_index(np.nanargmax(slope), slope.shape)
    where = row.part.arguments[n], dict(zip(row.part.arguments, points[k], strict=True))
    assert slope[k, n] <= 1e-8, (slope[k, n], *where, got[1][k, n], want[1][k, n])


@rows
def test_value_and_derivative(row: Row):
    """Against 40 digits on the very same numbers; derivatives against difference quotients, at all or some directions."""
    value, slopes = (x[:, at(row)] for x in found(row))
    points, chosen = row.points(*row.directions()), row.compared()
    want = reference.tabulate("models", row.name, points[chosen], row.part.cosines)
    compare(row, (value[chosen], slopes[chosen]), want, points[chosen])
    if not chosen.all():
        rest = reference.values("models", row.name, points[~chosen])
        nothing = np.zeros((len(rest), points.shape[-1]))
        compare(row, (value[~chosen], nothing), (rest, nothing), points[~chosen])


@rows
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_finite(row: Row, dtype: type):
    """Values and derivatives at every corner; zero with zero gradient where a direction is at or below the horizon."""
    for x in found(row, dtype):
        assert np.isfinite(x).all()
        assert (x[:, 2 * N :] == 0).all()


@rows
def test_second_derivatives_are_finite(row: Row):
    """By every parameter and direction, at the corners: error bars need them."""
    part, few = row.part, np.r_[0:2, 12:26:4, 26, N - 5 : N]

    def along(x: jax.Array) -> jax.Array:
        """Second derivatives summed over one argument: not finite if any of them is not."""
        return jax.jvp(jax.grad(part.program), (x,), (jnp.ones_like(x),))[1]

    points = row.points(WI[few], WO[few]).reshape(-1, len(part.arguments))
    with jax.enable_x64(True):
        second = jax.jit(jax.vmap(along), compiler_options=measure.QUICKLY)
        assert np.isfinite(second(jnp.asarray(points))).all()


@pytest.mark.parametrize("row", [r for r in TABLE if r.reciprocal], ids=lambda r: r.name)
def test_reciprocity(row: Row):
    """f(l, v) = f(v, l) to the rounding of exponents of up to 700."""
    value = found(row)[0]
    np.testing.assert_allclose(value[:, :N], value[:, N : 2 * N], rtol=1e-12, atol=1e-290)


@pytest.mark.parametrize("row", [r for r in TABLE if not r.reciprocal], ids=lambda r: r.name)
def test_no_reciprocity(row: Row):
    """Those whose docstring says that they are not."""
    assert "ot reciprocal" in (row.model.__doc__ or "")
    value = found(row)[0]
    there, back = value[:, :N], value[:, N : 2 * N]
    both = np.minimum(there, back) > 0
    assert np.max(np.abs(there[both] / back[both] - 1)) > 0.01


@pytest.mark.parametrize("row", [r for r in TABLE if r.energy], ids=lambda r: r.name)
def test_energy(row: Row):
    """No albedo above 1, by a rule of 64 by 20 half vectors, which is good to 1e-6 for these widths."""
    numbers = jnp.asarray([[c[p.name] for p in parameters_of(row.model)] for c in row.energy])
    with jax.enable_x64(True):

        def one(x: jax.Array, a: jax.Array, b: jax.Array) -> jax.Array:
            return row.part.program(jnp.concatenate([x, a, b]))

        f = jax.jit(jax.vmap(jax.vmap(one, (None, None, 0)), (0, None, None)))
        for theta in np.radians([0.0, 30.0, 60.0, 80.0, 89.0]):
            light, viewers, weight = hemisphere(theta)
            albedo = np.asarray(f(numbers, jnp.asarray(light), jnp.asarray(viewers))) @ weight
            assert (albedo <= 1 + 1e-6).all(), (np.degrees(theta), albedo)


@pytest.mark.parametrize("row", TABLE[:8], ids=lambda r: r.name)
def test_eager_is_jit_is_vmap(row: Row):
    """One program compiled and mapped over directions, or run operation by operation for each: the same but for fused
    roundings. What the models share is tested with those that are fitted by default.
    """
    wi, wo = WI[::16], WO[::16]
    with jax.enable_x64(True):
        m = models.build(row.model, dict(row.cases[0]))
        eager = np.stack([np.asarray(m(a, b)) for a, b in zip(wi, wo, strict=True)])
        mapped = np.asarray(jax.jit(jax.vmap(lambda a, b: m(a, b)))(wi, wo))
    assert eager.shape == (len(wi), 3)
    np.testing.assert_allclose(mapped, eager, rtol=1e-12, atol=1e-290)


@pytest.mark.parametrize("name", [n for n, v in MODELS.items() if len(v) > 1])
def test_anisotropic_with_equal_widths(name: str):
    """Equals the isotropic form, to the rounding of exponents of up to 700."""
    round_row, long_row = (next(r for r in TABLE if r.model is v) for v in MODELS[name])
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
    same = found(Row(long_row.model, tuple(split)))[0]
    np.testing.assert_allclose(same[:, :N], found(round_row)[0][:, :N], rtol=1e-12, atol=1e-290)


def test_absent_effects_cost_nothing():
    """The program of a model holds the operations of its formula and no others."""
    with jax.enable_x64(True):
        g = from_directions(WI, WO)

        def program(m: BRDF) -> str:
            return str(jax.make_jaxpr(lambda m: m.evaluate(g))(m))

        first = {r.name: models.build(r.model, dict(r.cases[0])) for r in TABLE[:8]}
        scalar = {name: jax.tree.map(lambda x: jnp.asarray(x).reshape(-1)[0], m) for name, m in first.items()}
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
        value, *slopes = oracle.projected_area(oracle.gtr, tuple(point[:2]), point[2])
        # 4e-11 is what the oracle leaves out at either end
        assert float(value / area(*point)) == pytest.approx(1, rel=1e-10)
        assert float(oracle.gtr_masking(*point) * value / point[2]) == pytest.approx(1, rel=1e-15)
        step = oracle.mpf("1e-6")  # whose square is what the quotient errs by, a few times
        for k, slope in enumerate(slopes):
            high, low = (area(*(x + s * (k == n) for n, x in enumerate(point))) for s in (step, -step))
            assert float(slope / ((high - low) / (2 * step))) == pytest.approx(1, rel=2e-10)


def test_lobes_of_lafortune():
    """Four lobes of which two are black are the other two; a model has at least one."""
    shapes = {"tilt_1": 0.8, "tilt_2": -0.7, "exponent_1": 40.0, "exponent_2": 5.0}
    scales = {"diffuse": 0.1, "specular_1": 0.3, "specular_2": 0.2}
    black = {f"{name}_{k}": 0.0 for name in ("specular", "tilt", "exponent") for k in (3, 4)}
    four = models.build(lobes(4), {**scales, **shapes, **black})
    with jax.enable_x64(True):
        np.testing.assert_array_equal(four(WI, WO), models.model("lafortune2", **scales, **shapes)(WI, WO))
    with pytest.raises(ValueError, match="Lafortune's model has at least one lobe, not 0"):
        lobes(0)


def test_a_model_is_a_function():
    """``jax.jit``, ``jax.vmap`` and ``jax.grad`` take it as it is, ready or not; in float32, and later in float64."""
    model = brdfit.model("gtr", diffuse=0.1, specular=[0.2, 0.3], alpha=0.2, gamma=1.5)
    wi, wo = jnp.array([0.6, 0, 0.8]), jnp.array([0, 0.6, 0.8])
    value = np.asarray(model(wi, wo))
    # rounding of float32 through a dozen operations; 2e-6 more from a table
    np.testing.assert_allclose(jax.jit(model)(wi, wo), value, rtol=1e-6)
    ready = brdfit.ready(model)
    for f in (ready, jax.jit(ready)):
        np.testing.assert_allclose(f(wi, wo), value, rtol=4e-6)
    np.testing.assert_allclose(jax.vmap(model, (0, None))(jnp.stack([wi, wo]), wo)[0], value, rtol=1e-6)
    own = jax.grad(lambda m: m(wi, wo).sum())(model)
    read = jax.grad(lambda m: brdfit.ready(m)(wi, wo).sum())(model)
    for a, b in zip(jax.tree.leaves(own), jax.tree.leaves(read), strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-4)
    assert len(jax.tree.leaves(jax.grad(lambda r: r(wi, wo).sum())(ready))) == 5
    with jax.enable_x64(True):
        np.testing.assert_allclose(jax.jit(model)(np.asarray(wi, float), np.asarray(wo, float)), value, rtol=1e-6)
