"""Tables that no measurement should be: a fit of them is a result with its reason, never NaN, never an exception."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import brdfit
import numpy as np
import pytest
from brdfit.data.synthetic import Missing, Outliers, Relative, generate
from brdfit.models import MODELS
from brdfit.models.base import BRDF, parameter, parameters_of
from brdfit.tables.table import Table
from jaxtyping import Array, Float

GRID = (20, 14, 18)
FIVE = ("gtr", "abc", "sgd", "ward", "ashikhmin_shirley")


def base() -> Table:
    return generate("abc-nickel", grid=GRID)[0]


def with_planes(change, table: Table | None = None) -> Table:
    table = table or base()
    return replace(table, planes=np.where(table.mask, change(table.planes), -1.0))


def black_channel(planes):
    return planes * np.array([1.0, 0.0, 1.0])[:, None, None, None]


def one_cell(table: Table) -> Table:
    mask = np.zeros_like(table.mask)
    mask[3, 4, 5] = True
    assert table.mask[3, 4, 5]
    return replace(table, mask=mask)


def delta(planes):
    """A lobe narrower than a cell: the first row of theta_h, a million times brighter than the rest."""
    out = np.full_like(planes, 0.03)
    out[:, 0] = 3e4
    return out


def spread_out(planes):
    return 10 ** np.random.default_rng(0).uniform(-9, 9, planes.shape)


def noise(planes):
    return np.abs(np.random.default_rng(0).standard_normal(planes.shape))


HOSTILE = {
    "zeros": lambda: with_planes(np.zeros_like),
    "constant": lambda: with_planes(lambda p: np.full_like(p, 0.1)),
    "huge": lambda: with_planes(lambda p: p * 1e9),
    "tiny": lambda: with_planes(lambda p: p * 1e-9),
    "one cell": lambda: one_cell(base()),
    "black channel": lambda: with_planes(black_channel),
    "from 1e-9 to 1e9": lambda: with_planes(spread_out),
    "outliers": lambda: generate("abc-nickel", grid=GRID, noise=[Outliers(0.01, 1e6)])[0],
    "90 % missing": lambda: generate("abc-nickel", grid=GRID, noise=[Missing(0.9), Relative(0.05)])[0],
    "pure noise": lambda: with_planes(noise),
    "delta": lambda: with_planes(delta),
    "another model": lambda: generate("misfit-retro", grid=GRID)[0],
}


HONEST = {
    # a lobe that the grid does not resolve is a valley without end
    ("gtr", "delta"): "stopped at the limit of 300 steps",
    # f0 = 1e13 at specular -> 0, where the derivative by specular is a difference of terms of size f0
    ("sgd", "from 1e-9 to 1e9"): "stalled after",
}
"""Fits that may fail to converge, and what they say then."""


def check(fit: brdfit.Fit) -> None:
    """What holds for every fit, however bad the table."""
    assert fit.reason
    assert fit.model is not None
    for name, value in fit.parameters.items():
        assert np.isfinite(value).all(), (name, value)
        spec = next(p for p in parameters_of(fit.model) if p.name == name)
        assert all(v in spec.valid for v in value.ravel()), (name, value)
    for name, value in fit.errors.items():
        assert np.isfinite(value), name
    # an uncertainty is a positive number, or NaN with its cause told
    told = " ".join([*fit.undetermined, *fit.at_bound, *fit.fixed])
    for part in (fit.stderr, fit.spread):
        for name, value in part.items():
            assert (np.isnan(value) | ((value >= 0) & np.isfinite(value))).all(), (name, value)
    for name, value in fit.stderr.items():
        if np.isnan(value).any() and fit.errors[fit.loss] > 1e-12 and fit.converged:
            assert name in told, (name, value, told)
    for row in fit.covariance.values():
        for block in row.values():
            assert np.isfinite(block).all()
    assert not np.isinf(fit.correlation).any()
    fit.record()


@pytest.mark.parametrize("model", FIVE)
def test_hostile_tables(model):
    """All tables in one test, so that a model is compiled once."""
    faults = {}
    for name, make in HOSTILE.items():
        fit = brdfit.fit(make(), model)
        try:
            check(fit)
            known = HONEST.get((model, name))
            assert fit.converged or (known and fit.reason.startswith(known)), fit.reason
        except AssertionError as fault:
            faults[name] = str(fault).splitlines()[0]
    assert not faults


@pytest.mark.parametrize("loss", ["cuberoot", "relative"])
def test_hostile_tables_under_other_losses(loss):
    for name in ("zeros", "black channel", "from 1e-9 to 1e9", "one cell", "outliers"):
        check(brdfit.fit(HOSTILE[name](), "ward", loss=loss))


def test_what_each_table_says():
    """The answers, where they are known."""
    zeros = brdfit.fit(HOSTILE["zeros"](), "ward")
    assert zeros.errors["log"] < 1e-12
    assert (zeros.parameters["diffuse"] < 1e-12).all()
    constant = brdfit.fit(HOSTILE["constant"](), "ward")
    np.testing.assert_allclose(constant.parameters["diffuse"], 0.1 * np.pi, rtol=1e-6)
    black = brdfit.fit(HOSTILE["black channel"](), "ward")
    # at the bound, or as near to it as the other channels' rounding can see
    assert black.parameters["diffuse"][1] < 1e-12
    assert black.parameters["specular"][1] < 1e-12
    one = brdfit.fit(HOSTILE["one cell"](), "ward")
    assert one.cells["used"] == 1
    assert one.errors["log"] < 1e-9
    assert set(one.undetermined) | {b.split(" ")[0] for b in one.at_bound} >= {"alpha"}


def test_scale_is_no_matter_where_the_loss_has_none():
    """Under a loss that is linear in the values, a table in other units gives the same fit, from 1e-9 to 1e9."""
    fits = {s: brdfit.fit(with_planes(lambda p, s=s: p * s), "ward", loss="ngan") for s in (1e-9, 1.0, 1e9)}
    for scale, fit in fits.items():
        assert fit.converged, (scale, fit.reason)
        assert not fit.reason.startswith("exact"), (scale, fit.reason)
        np.testing.assert_allclose(fit.parameters["alpha"], fits[1.0].parameters["alpha"], rtol=1e-4)
        np.testing.assert_allclose(fit.parameters["specular"], fits[1.0].parameters["specular"] * scale, rtol=1e-4)


def corners(model: str) -> list[dict[str, float]]:
    """Every corner of the shapes' search box."""
    shapes = [p for p in parameters_of(MODELS[model][0]) if not p.linear]
    ends = [[max(p.search[0], -1e3), min(p.search[1], 1e9)] for p in shapes]
    return [dict(zip((p.name for p in shapes), corner, strict=True)) for corner in product(*ends)]


@pytest.mark.parametrize("model", FIVE)
def test_start_at_every_corner(model):
    table = base()
    plain = brdfit.fit(table, model)
    for corner in corners(model):
        fit = brdfit.fit(table, model, start=corner)
        check(fit)
        assert fit.converged, (corner, fit.reason)
        # one more start never makes it worse: up to where the search stops, and to rounding where the fit is exact
        assert fit.errors["log"] <= plain.errors["log"] * (1 + 1e-6) + 1e-14, corner


@pytest.mark.parametrize("model", FIVE)
def test_every_parameter_held_but_one(model):
    table = base()
    fitted = brdfit.fit(table, model)
    values = {n: v * 1.1 + 0.01 for n, v in fitted.parameters.items()}
    specs = {p.name: p for p in parameters_of(fitted.model)}
    for name in specs:
        fixed = {n: np.clip(v, None, specs[n].valid.upper) for n, v in values.items() if n != name}
        fit = brdfit.fit(table, model, fixed=fixed)
        check(fit)
        assert fit.converged, (name, fit.reason)
        for n, v in fixed.items():
            np.testing.assert_allclose(fit.parameters[n], v, rtol=1e-12)


class Twins(BRDF):
    """Two copies of one parameter: only their sum is determined."""

    name = "twins"

    first: Float[Array, " C"] = parameter("a body", per_channel=True, linear=True, default=0.1)
    second: Float[Array, " C"] = parameter("the same again", per_channel=True, linear=True, default=0.1)
    width: Float[Array, ""] = parameter("lobe", search=(1e-3, 10), default=0.3, log=True)

    def evaluate(self, g):
        return self.first + self.second + 0.1 * np.e ** (-g.tan2_h / self.width**2)


class Product(BRDF):
    """A ridge that bends: only the product of two parameters is determined."""

    name = "product"

    scale: Float[Array, ""] = parameter("a factor", search=(1e-6, 1e6), default=1.0, log=True)
    gain: Float[Array, ""] = parameter("another", search=(1e-6, 1e6), default=1.0, log=True)
    body: Float[Array, " C"] = parameter("body", per_channel=True, linear=True, default=0.1)

    def evaluate(self, g):
        return self.body + self.scale * self.gain * g.cos_h**20


class Idle(BRDF):
    """A parameter without any effect."""

    name = "idle"

    body: Float[Array, " C"] = parameter("body", per_channel=True, linear=True, default=0.1)
    nothing: Float[Array, ""] = parameter("no effect", search=(0, 1), default=0.5)

    def evaluate(self, g):
        return self.body + 0 * self.nothing


def test_ridges_are_told():
    table = generate("ward-06", grid=GRID, noise=[Relative(0.05)])[0]
    for model, idle in ((Twins, ("first", "second")), (Product, ("scale", "gain")), (Idle, ("nothing",))):
        fit = brdfit.fit(table, model)
        check(fit)
        assert fit.converged, fit.reason
        told = {u.split("[")[0] for u in fit.undetermined}
        assert told == set(idle), (model, fit.undetermined)
        for n in idle:
            assert np.isnan(fit.stderr[n]).all()
        for n in set(fit.parameters) - told:
            assert (fit.stderr[n] > 0).all()
