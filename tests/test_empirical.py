"""Properties of the empirical and wave-optical models, over their table of cases: one program a model and precision."""

from __future__ import annotations

from functools import cache
from typing import Any

import brdfit
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from brdfit import models
from brdfit.models import BRDF, parameters_of
from brdfit.models.kirchhoff import scattering_series
from brdfit.models.lafortune import lobes
from brdfit.programs import OPTIONS
from brdfit.reports.physics import hemisphere
from brdfit.stability import empirical as oracle
from brdfit.tables import HalfDifferenceGrid, table

from .empirical_cases import EMPIRICAL, SLOPES, WI, WO, Row
from .microfacet_cases import MICROFACETS

ROWS = (*EMPIRICAL, *MICROFACETS)

rows = pytest.mark.parametrize("row", ROWS, ids=lambda r: r.name)

N = len(WI)
UP, LEVEL = np.array([0.6, 0.0, 0.8]), np.array([1.0, 0.0, 0.0])
BELOW = [(UP, -UP), (-UP, UP), (-UP, -UP), (LEVEL, UP), (UP, LEVEL), (UP * [1, 1, -1], UP * [1, 1, -1])]
ALL_WI = np.concatenate([WI, WO, [a for a, _ in BELOW]])
ALL_WO = np.concatenate([WO, WI, [b for _, b in BELOW]])
"""The directions, the same exchanged, and pairs below the horizon."""

Found = tuple[np.ndarray, dict[str, np.ndarray]]


QUICKLY = {**OPTIONS, "xla_backend_optimization_level": 0}
"""Programs that run once: to compile them takes a third of the time so, and all of the test's."""


@cache
def program(cls: type[BRDF]) -> Any:
    """Values and derivatives by parameters and directions, compiled once a class and precision."""

    def one(m: BRDF, wi: jax.Array, wo: jax.Array) -> jax.Array:
        return m(wi, wo)[0]

    inner = jax.vmap(jax.value_and_grad(one, (0, 1, 2)), (None, 0, 0))
    return jax.jit(jax.vmap(inner, (0, None, None)), compiler_options=QUICKLY)


def evaluate(row: Row, stacked: BRDF, wi: np.ndarray, wo: np.ndarray, dtype: type = np.float64) -> Found:
    """Values ``[cases, directions]`` and slopes by name."""
    with jax.enable_x64(dtype is np.float64):
        stacked = jax.tree.map(lambda x: jnp.asarray(x, dtype), stacked)
        value, (by_model, by_wi, by_wo) = program(row.model)(stacked, wi.astype(dtype), wo.astype(dtype))
        assert value.dtype == dtype
    slopes = {p.name: np.asarray(getattr(by_model, p.name)).reshape(value.shape) for p in parameters_of(row.model)}
    for name, by in (("wi", by_wi), ("wo", by_wo)):
        slopes |= {f"{name}_{k}": np.asarray(by)[..., k] for k in range(3)}
    return np.asarray(value), slopes


@cache
def found(name: str) -> Found:
    row = next(r for r in ROWS if r.name == name)
    return evaluate(row, row.stacked(), ALL_WI, ALL_WO)


@rows
def test_value(row: Row):
    """Against 40 digits, to what is promised of it; 500 values and more."""
    got = found(row.name)[0][:, :N]
    want = np.array([[float(oracle.value(row.name, dict(c), a, b)) for a, b in zip(WI, WO, strict=True)] for c in row.cases])
    assert want.size >= 500
    error = np.abs(got - want) / (np.abs(want) + 1e-280)
    w = np.unravel_index(np.nanargmax(error), error.shape)
    assert np.isfinite(got).all()
    assert error.max() <= row.tolerance, (error.max(), row.cases[w[0]], WI[w[1]], WO[w[1]], got[w], want[w])


@rows
def test_derivative(row: Row):
    """Against 40-digit difference quotients, to 1e-8 of the larger of the derivative and value/parameter."""
    value, slopes = found(row.name)
    for k, case in enumerate(row.cases):
        stride = 5 if row.series else 2
        for d in SLOPES[k % stride :: stride] % N:
            want = oracle.gradient(row.name, dict(case), WI[d], WO[d])
            got = {n: s[k, d] for n, s in slopes.items()}
            for end, w in (("wi", WI[d]), ("wo", WO[d])):  # of the gradient only what is tangential means anything
                for slope in (got, want):
                    g = np.array([float(slope[f"{end}_{i}"]) for i in range(3)])
                    slope |= {f"{end}_{i}": x for i, x in enumerate(g - w * (w @ g))}
            for name, slope in got.items():
                if name not in case and row.kink is not None and row.kink[d]:
                    continue
                exact, size = float(want[name]), abs(case.get(name, 1.0))
                scale = max(abs(exact), value[k, d] / size if size else 0.0)
                assert abs(slope - exact) <= 1e-8 * scale + 1e-150, (name, slope, exact, case, WI[d], WO[d])


@rows
def test_finite(row: Row):
    """Values and derivatives at every corner; zero with zero gradient at and below the horizon."""
    value, slopes = found(row.name)
    for name, v in {"value": value, **slopes}.items():
        assert np.isfinite(v).all(), name
        assert (v[:, 2 * N :] == 0).all(), name


@pytest.mark.parametrize("row", [r for r in ROWS if r.reciprocal], ids=lambda r: r.name)
def test_reciprocity(row: Row):
    value = found(row.name)[0]
    np.testing.assert_allclose(value[:, :N], value[:, N : 2 * N], rtol=1e-12, atol=1e-290)


@pytest.mark.parametrize("row", [r for r in ROWS if r.single], ids=lambda r: r.name)
def test_single_precision(row: Row):
    """float32 on numbers that it holds, against float64: 1e-5 of the value or the body term, or a dozen times what one
    rounding of the parameters and directions changes, which is what a formula's own roundings come to.
    """
    stacked = row.stacked(np.float32)
    wi, wo = (w.astype(np.float32) for w in (ALL_WI, ALL_WO))
    got, slopes = evaluate(row, stacked, wi, wo, np.float32)
    want, exact = evaluate(row, stacked, wi.astype(float), wo.astype(float))
    assert np.isfinite(got).all()
    body = np.array([c.get("diffuse", 0) / np.pi for c in row.cases])[:, None]
    size = {n: np.array([c[n] for c in row.cases])[:, None] for n in row.cases[0]}
    for name, w in (("wi", wi), ("wo", wo)):
        along = sum(w[:, k] * exact[f"{name}_{k}"] for k in range(3))
        exact |= {f"{name}_{k}": exact[f"{name}_{k}"] - w[:, k] * along for k in range(3)}
    moved = sum(np.abs(slope * size.get(n, 1.0)) for n, slope in exact.items()) * 2.0**-24
    error = np.abs(got - want) / (np.maximum(1e-5 * np.maximum(np.abs(want), body), 12 * moved) + 1e-28)
    w = np.unravel_index(np.argmax(error), error.shape)
    assert (error <= 1).all(), (error[w], row.cases[w[0]], wi[w[1]], wo[w[1]], got[w], want[w])
    for name, slope in slopes.items():
        assert np.isfinite(slope).all(), name


@pytest.mark.parametrize("row", [r for r in ROWS if r.energy], ids=lambda r: r.name)
def test_energy(row: Row):
    """No albedo above 1, by a rule of 64 by 20 half vectors, which is good to 1e-6 for these widths."""
    with jax.enable_x64(True):
        stacked = jax.tree.map(jnp.asarray, row.stacked(cases=row.energy))
        f = jax.jit(jax.vmap(lambda m, a, b: m(a, b)[..., 0], (0, None, None)))
        for theta in np.radians([0.0, 30.0, 60.0, 80.0, 89.0]):
            light, viewers, weight = hemisphere(theta)
            albedo = np.asarray(f(stacked, jnp.asarray(light), jnp.asarray(viewers))) @ weight
            assert (albedo <= 1 + 1e-6).all(), (np.degrees(theta), albedo)


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


def test_mirror_term():
    """The specular term of HTSG, which no table holds, against 40 digits, from normal incidence to grazing."""
    theta = np.radians([0, 1e-3, 10, 40, 70, 85, 89, 89.99])
    light = np.stack([np.sin(theta), 0 * theta, np.sin(np.pi / 2 - theta)], -1)
    mirror = jax.jit(lambda m, w: m.mirror_reflectance(w))
    with oracle.mp.workdps(oracle.DIGITS), jax.enable_x64(True):
        for sigma, tau, ior in ((0.02, 3.0, 1.5), (0.1, 0.4, 20.0), (0.3, 1.0, 1.5), (0.5, 9.0, 1.3)):
            m = models.model("htsg", diffuse=[0.1], specular=[0.7], ior=ior, sigma=sigma, tau=tau)
            got = np.asarray(mirror(m, light))[:, 0]
            numbers = [oracle.mpf(x) for x in (0.7, ior, sigma, tau)]
            want = [float(oracle.htsg_mirror(oracle.unit([oracle.mpf(float(x)) for x in w]), *numbers)) for w in light]
            np.testing.assert_allclose(got, want, rtol=1e-11)


def test_waves_become_facets():
    """For sigma -> infinity at a given slope m = 2 sigma/tau, HTSG is F S D/(4 n.l n.v) with Beckmann's D, to 1/g."""
    sigma, m, theta = 30.0, 0.3, np.radians([[0, 5, 20, 40], [0, 10, 30, 30]])
    light, viewer = (np.stack([s * np.sin(t), 0 * t, np.cos(t)], -1) for s, t in ((1, theta[0]), (-1, theta[1])))
    half = (light + viewer) / np.linalg.norm(light + viewer, axis=-1, keepdims=True)
    cos2 = half[:, 2] ** 2
    beckmann = np.exp(-(1 / cos2 - 1) / m**2) / (np.pi * m**2 * cos2**2)
    with jax.enable_x64(True):
        waves = models.model("htsg", diffuse=0.0, specular=1.0, ior=1e6, sigma=sigma, tau=2 * sigma / m)
        got = np.asarray(jax.jit(lambda a, b: waves(a, b))(light, viewer))[:, 0]
    np.testing.assert_allclose(got, beckmann / (4 * light[:, 2] * viewer[:, 2]), rtol=5e-3)  # S: 3e-3 at 40 degrees


def test_series():
    """The sum that HTSG and Stam share, over the corners of its two arguments, against 500 and more term-by-term sums."""
    g, t = np.meshgrid(np.geomspace(1e-12, 3e3, 27), [0, *np.geomspace(1e-8, 1e5, 18)])
    with jax.enable_x64(True):
        f = jax.jit(jax.vmap(jax.value_and_grad(scattering_series, (0, 1))))
        got, slopes = f(jnp.asarray(g.ravel()), jnp.asarray(t.ravel()))
    assert all(np.isfinite(s).all() for s in slopes)
    with oracle.mp.workdps(20):  # of which 1e-25 is left out
        want = [float(oracle.series(oracle.mpf(a), oracle.mpf(b))) for a, b in zip(g.ravel(), t.ravel(), strict=True)]
    # 1e-300: below, powers of g have lost digits; exponents of some hundreds count roundings as often
    np.testing.assert_allclose(got, want, rtol=1e-12, atol=1e-290)


def small_grid(shape: tuple[int, int, int]) -> HalfDifferenceGrid:
    edges = [np.linspace(0, 1, n + 1) for n in shape]
    th, td, pd = edges[0] ** 2 * np.pi / 2, edges[1] * np.pi / 2, edges[2] * np.pi
    return HalfDifferenceGrid(th[:-1], td[:-1], pd[:-1], th, td, pd)


@rows
def test_search_box(row: Row):
    """What a fit searches is where the formula is defined, and so are the cases."""
    for p in parameters_of(row.model):
        assert all(end in p.valid or np.isinf(end) for end in p.search), p
    for case in row.cases:
        models.build(row.model, dict(case))


@pytest.mark.parametrize("row", [r for r in ROWS if r.truth is not None], ids=lambda r: r.name)
def test_recovery(row: Row):
    """A noiseless table of known parameters, fitted from automatic starts: the parameters come back."""
    truth = {p.name: p.default for p in parameters_of(row.model)} | dict(row.truth)
    for p in parameters_of(row.model):
        if p.per_channel and p.name not in row.truth:
            truth[p.name] = [truth[p.name], 0.6 * truth[p.name]]
    brdf = models.model(row.model.name, **truth)
    grid = small_grid(row.grid)
    wi, wo = grid.directions()
    with jax.enable_x64(True):
        planes = np.moveaxis(np.asarray(brdf(wi, wo)), -1, 0)
    planes = np.where((wi[..., 2] <= 0) | (wo[..., 2] <= 0), -1.0, planes)
    fit = brdfit.fit(table(planes, grid, "truth"), row.model.name)
    assert fit.converged, fit.reason
    assert not fit.undetermined
    for name, true in truth.items():
        np.testing.assert_allclose(fit.parameters[name], true, rtol=1e-6, err_msg=name)
