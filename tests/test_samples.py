"""Blocks of cells: every fitted cell once, with its measure, spread over the table whatever part is looked at."""

from __future__ import annotations

from dataclasses import replace

import brdfit
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from brdfit.data.synthetic import generate, grid, scattered
from brdfit.fitting import samples as module
from brdfit.fitting.coordinates import charts
from brdfit.fitting.gram import Problem, Span, gram, statistics
from brdfit.fitting.losses import LOSSES
from brdfit.models.sgd import SGD
from brdfit.tables.layout import HalfDifferenceGrid, SphericalGrid
from brdfit.tables.merl import merl_grid
from brdfit.tables.table import table as make_table


def spherical(anisotropic: bool) -> SphericalGrid:
    def axis(n: int, end: float):
        edges = np.linspace(0, end, n + 1)
        return (edges[:-1] + edges[1:]) / 2, edges

    (ti, tie), (to, toe), (po, poe) = axis(9, np.pi / 2), axis(11, np.pi / 2), axis(14, 2 * np.pi)
    pi_, pie = axis(5, 2 * np.pi)
    if anisotropic:
        return SphericalGrid(ti, to, po, tie, toe, poe, pi_, pie)
    return SphericalGrid(ti, to, po, tie, toe, poe)


LAYOUTS = {
    "half/difference": lambda: grid((23, 17, 26)),
    "one row": lambda: grid((1, 6, 9)),
    "360 degrees": lambda: merl_grid((12, 10, 30), angles="edge", phi_period=360),
    "centre": lambda: grid((20, 21, 19), "centre"),
    "anisotropic": lambda: grid((6, 9, 8, 12)),
    "spherical": lambda: spherical(False),
    "spherical anisotropic": lambda: spherical(True),
    "scattered": lambda: scattered(9000, 3),
    "few scattered": lambda: scattered(5, 3),
}


def numbered(layout, missing: float = 0.2):
    """A table whose values are the numbers of its cells, from 1, in channel 0 and minus a half in channel 1."""
    n = int(np.prod(layout.shape))
    values = np.arange(1.0, n + 1).reshape(layout.shape)
    gone = np.random.default_rng(0).random(layout.shape) < missing
    return make_table(np.stack([np.where(gone, np.nan, values), values - 0.5]), layout, "numbered")


def cells_of(s, first=0, count=None):
    """Flat arrays of the cells in some blocks of cells: numbers, weights, and the four cosines; no empty ones."""
    out = []
    start = getattr(s, "compressed", 0)
    for i in range(start + first, start + (s.blocks if count is None else first + count)):
        g, measured, weight = s.block(jnp.asarray(i))
        shape = weight.shape
        parts = [measured[0], measured[1], weight, g.cos_i, g.cos_o, g.cos_h, g.cos_d]
        out.append(np.stack([np.broadcast_to(np.asarray(p), shape).reshape(-1) for p in parts]))
    flat = np.concatenate(out, 1)
    return flat[:, flat[2] > 0]


@pytest.mark.parametrize("measure", ["solid_angle", "cells"])
@pytest.mark.parametrize("name", LAYOUTS)
def test_every_fitted_cell_once(name, measure):
    t = numbered(LAYOUTS[name]())
    with jax.enable_x64(True):
        s, used = module.samples(t, 80.0, measure)
        found = cells_of(s)
    np.testing.assert_array_equal(used, t.within(np.radians(80)))
    share = np.broadcast_to(t.layout.solid_angle(), used.shape) if measure == "solid_angle" else np.ones(used.shape)
    share = np.where(used, share, 0.0).reshape(-1)
    share /= share.sum()
    number = found[0].astype(int) - 1
    assert len(set(number)) == len(number), "a cell is there twice"
    # cells of the first row or column may have no extent on an edge grid: they have no weight and nothing to say
    assert set(number) == set(np.flatnonzero(share > 0))
    np.testing.assert_array_equal(found[1], found[0] - 0.5)  # channels stay together
    np.testing.assert_allclose(found[2], share[number], rtol=1e-12)
    assert found[2].sum() == pytest.approx(1, abs=1e-12)
    wi, wo = (v.reshape(-1, 3)[number] for v in t.layout.directions())
    h = wi + wo
    h /= np.linalg.norm(h, axis=1, keepdims=True)
    want = np.stack([wi[:, 2], wo[:, 2], h[:, 2], (wi * h).sum(1)])
    np.testing.assert_allclose(found[3:], want, atol=1e-13)


@pytest.mark.parametrize("name", ["half/difference", "360 degrees", "anisotropic", "scattered"])
@pytest.mark.parametrize("count", [1, 2])
def test_a_few_blocks_are_a_small_copy_of_the_table(name, count):
    """Every band of theta_h and theta_d has its share in a few blocks, up to a factor of 3, whichever those are."""
    t = numbered(LAYOUTS[name](), 0.0)
    with jax.enable_x64(True):
        s, _ = module.samples(t, 80.0, "cells")
        whole = cells_of(s)
        for first in range(s.blocks - count + 1):
            part = cells_of(s, first, count)
            for row in (5, 6):  # cos_h, cos_d
                edges = np.quantile(whole[row], [0, 0.25, 0.5, 0.75, 1])
                edges[0], edges[-1] = -1, 2
                share = np.histogram(part[row], edges)[0] / part.shape[1]
                expected = np.histogram(whole[row], edges)[0] / whole.shape[1]
                assert ((share > expected / 3) & (share < expected * 3)).all(), (first, row, share, expected)


def test_bands_are_bands():
    """The jackknife's bands are made of neighbours: each spans a ninth of theta_h and a strip of theta_d."""
    t = numbered(LAYOUTS["half/difference"](), 0.0)
    with jax.enable_x64(True):
        s, _ = module.samples(t, 80.0, "cells")
        g, _, weight = s.block(jnp.asarray(getattr(s, "compressed", 0)))
        theta_h = np.broadcast_to(np.asarray(g.theta_h), weight.shape).reshape(s.banded)
        kept = np.asarray(weight).reshape(s.banded) > 0
    bands = np.moveaxis(theta_h, s.band_axes, range(len(s.band_axes))).reshape(*(s.banded[a] for a in s.band_axes), -1)
    kept = np.moveaxis(kept, s.band_axes, range(len(s.band_axes))).reshape(bands.shape)
    low = np.where(kept, bands, np.inf).min((1, 2))
    high = np.where(kept, bands, -np.inf).max((1, 2))
    live = np.isfinite(low)
    assert live.sum() > 4
    assert (high[live][:-1] < low[live][1:]).all()


GARBAGE = (np.nan, np.inf, -1.0, 1e300)


def test_unused_cells_are_harmless():
    """What stands in cells that are masked or beyond the limit changes nothing, to the bit; the grid reaches 90 degrees."""
    layout = HalfDifferenceGrid(
        *(np.radians(np.linspace(0, 90, 10)), np.radians(np.linspace(0, 90, 9)), np.radians(np.linspace(0, 180, 12))),
        *(np.radians(np.linspace(0, 90, n + 1) * (2 if n == 12 else 1)) for n in (10, 9, 12)),
    )
    t, _ = generate("sgd-12", grid=layout)
    mask = t.mask & (np.random.default_rng(0).random(t.mask.shape) < 0.7)
    chart = charts(SGD)[0]
    grams = []

    @eqx.filter_jit
    def passes(problem, x):
        return gram(problem, x, Span.cells(problem.samples)), statistics(problem, x, (), Span.cells(problem.samples))[:2]

    with jax.enable_x64(True):
        for garbage in GARBAGE:
            table = replace(t, planes=np.where(mask, t.planes, garbage), mask=mask)
            cells, _ = module.samples(table, 80.0, "solid_angle")
            problem = Problem(cells, LOSSES["log"], chart)
            x = jnp.asarray(np.tile([0.1, 0.4, np.log(0.3), 0.5, 0.2, 0.05], 3))[: problem.size]
            g, (bands, middle) = jax.tree.map(np.asarray, passes(problem, x))
            assert np.isfinite(g).all()
            assert np.isfinite(bands).all()
            assert np.isfinite(middle).all()
            grams.append(g)
    for g in grams[1:]:
        np.testing.assert_array_equal(g, grams[0])
    assert grams[0][-1, -1] > 0


def test_cells_are_counted():
    t = numbered(LAYOUTS["half/difference"]())
    fit = brdfit.fit(t, "lambert")
    assert fit.cells == {"used": int(t.within(np.radians(80)).sum()), "masked": int((~t.mask).sum()), "total": t.mask.size}
    assert 0 < fit.cells["used"] < fit.cells["total"] - fit.cells["masked"]  # some are measured but beyond 80 degrees
    wider = brdfit.fit(t, "lambert", max_angle=85)
    assert wider.cells["used"] > fit.cells["used"]


@pytest.mark.parametrize(
    ("max_angle", "measure", "text"),
    [
        (90, "cells", r"max_angle must lie in \(0, 90\) degrees, not 90"),
        (0, "cells", "not 0"),
        (np.nan, "cells", "not nan"),
        (80, "area", "unknown measure 'area': choose solid_angle or cells"),
    ],
)
def test_wrong_arguments(max_angle, measure, text):
    with pytest.raises(ValueError, match=text):
        module.samples(numbered(LAYOUTS["one row"]()), max_angle, measure)
