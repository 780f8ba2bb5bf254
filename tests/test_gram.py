"""The Gram matrix of a pass against a dense Jacobian over all cells, and what becomes of it where it is singular."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from brdfit.data.synthetic import RANGES, Missing, Relative, generate, material
from brdfit.fitting.compression import row_rules
from brdfit.fitting.coordinates import charts
from brdfit.fitting.gram import Problem, Span, curved_gram, factor, gram, gram_residual, statistics
from brdfit.fitting.grid_samples import compress
from brdfit.fitting.losses import LOSSES, named_loss
from brdfit.fitting.samples import samples
from brdfit.fitting.solver import Box, minimise
from brdfit.models import MODELS, parameter_values

GRID = (9, 7, 8)


def luminance(f, m, g):
    """A loss that ties the channels together, with one residual a cell."""
    return (jnp.log1p(f * g.cos_i[:, None]) - jnp.log1p(m * g.cos_i[:, None])).sum(-1)


FORMS = [(name, cls) for name in (*RANGES, "lambert") for cls in MODELS[name]]
SOURCES = {"lambert": "ward-05"}


def problem_of(name, cls, loss):
    # lobes that span several cells of this small grid
    source = SOURCES.get(name, f"{name}-aniso-00" if cls.anisotropic else f"{name}-05")
    grid = (4, *GRID) if cls.anisotropic else GRID
    table, _ = generate(source, grid=grid, noise=[Relative(0.3), Missing(0.2)], seed=1, channels=2)
    cells, used = samples(table, 80.0, "solid_angle")
    chart = charts(cls)[0]
    truth = (
        parameter_values(material(SOURCES.get(name, source)).brdf(2))
        if name != "lambert"
        else {"diffuse": np.array([0.2, 0.3])}
    )
    x = chart.coordinates_of({n: np.asarray(v) for n, v in truth.items()}, 2)
    lower, upper = chart.box(2)
    x = np.clip(x + 0.03 * np.random.default_rng(0).uniform(-1, 1, x.shape), lower, upper)  # not where the table comes from
    return Problem(cells, named_loss(loss).bind(table.planes[:, used]), chart), jnp.asarray(x)


def dense_rows(problem: Problem, x):
    """Residuals of all cells as one function of x, every polar table made where it is used."""
    chart, c = problem.chart, problem.channels
    parts = []
    for i in range(problem.samples.compressed, problem.samples.compressed + problem.samples.blocks):
        g, measured, weight = problem.samples.block(jnp.asarray(i))
        own, shared = chart.split(x, c)
        each = [jnp.broadcast_to(chart.model(own[k], shared).evaluate(g), weight.shape).reshape(-1) for k in range(c)]
        flat = g.flat()
        f, m = jnp.stack(each, -1), jnp.moveaxis(measured, 0, -1).reshape(-1, c)
        w = weight.reshape(-1)
        relative = problem.loss.weight(flat)
        w = w if relative is None else w * relative
        r = jnp.asarray(problem.loss(f, m, flat)).reshape(w.size, -1)
        parts.append(jnp.sqrt(w)[:, None] * r)
    return jnp.concatenate(parts)


@eqx.filter_jit
def both(problem: Problem, x):
    rows = dense_rows(problem, x)
    jac = jax.jacfwd(lambda y: dense_rows(problem, y))(x)
    return (
        gram(problem, x, Span.cells(problem.samples)),
        statistics(problem, x, (), Span.cells(problem.samples))[:2],
        rows,
        jac,
    )


CASES = [
    *((name, cls, "log") for name, cls in FORMS),
    # a loss with a weight, and one that ties the channels together: with tables, with shared parameters only, and without
    *((n, MODELS[n][k], "perceptual") for n, k in (("ward", 1), ("lambert", 0))),
    *((n, MODELS[n][k], luminance) for n, k in (("gtr", 0), ("ward", 1), ("lambert", 0))),
]


@pytest.mark.parametrize(
    ("name", "cls", "loss"), CASES, ids=[f"{c.__name__}-{getattr(loss, '__name__', loss)}" for _, c, loss in CASES]
)
def test_gram_is_that_of_the_dense_jacobian(name, cls, loss):
    """Every model, whatever is tabulated beforehand, expanded to first order, or left out for being linear."""
    with jax.enable_x64(True):
        problem, x = problem_of(name, cls, loss)
        g, (bands, middle), rows, jac = (jax.tree.map(np.asarray, part) for part in both(problem, x))
    n = problem.size
    a = np.concatenate([jac.reshape(-1, n), rows.reshape(-1, 1)], 1)
    want = a.T @ a
    size = np.sqrt(np.diag(want))
    # sums of 1e3 products: rounding is 1e-13 of the product of the columns' norms; roots of 1e-17 in the tables add to it
    np.testing.assert_allclose(g / size / size[:, None], want / size / size[:, None], atol=1e-10)
    np.testing.assert_allclose(
        bands.reshape(-1, n + 1, n + 1).sum(0) / size / size[:, None], g / size / size[:, None], atol=1e-12
    )
    gradients = (jac * rows[..., None]).sum(1)
    middle_want = gradients.T @ gradients
    scale = np.sqrt(np.diag(middle_want))
    np.testing.assert_allclose(middle / scale / scale[:, None], middle_want / scale / scale[:, None], atol=1e-10)
    assert (size > 0).all()


@pytest.mark.parametrize(("name", "cls"), FORMS, ids=[c.__name__ for _, c in FORMS])
def test_linear_means_linear(name, cls):
    """A coordinate that says so: the value changes by the same amount for the same step, wherever it starts."""
    with jax.enable_x64(True):
        problem, x = problem_of(name, cls, "log")
        chart = problem.chart
        g, _, weight = problem.samples.block(jnp.asarray(problem.samples.compressed))
        kept = np.asarray(weight).reshape(-1) > 0

        @jax.jit
        def values(y):
            own, shared = chart.split(y, 2)
            return jnp.broadcast_to(chart.model(own[0], shared).evaluate(g), weight.shape).reshape(-1)

        seen = 0
        for i, (coordinate, channel) in enumerate(chart.vector(2)):
            if channel == 1:
                continue
            step = 0.05 * (1 + abs(float(x[i])))
            low, here, high = (np.asarray(values(x.at[i].add(s * step)))[kept] for s in (0, 1, 2))
            bend = np.abs(high - 2 * here + low)
            straight = bend <= 1e-13 * (np.abs(high) + np.abs(low))
            assert straight.all() == coordinate.linear, coordinate.name
            seen += coordinate.linear
        assert seen >= 1


@pytest.mark.parametrize("loss", ["log", luminance], ids=["log", "luminance"])
def test_curvature_where_a_coordinate_folds(loss):
    """sum w r r'' of abc's index against second derivatives of the dense residual, and as a further row of the problem."""
    with jax.enable_x64(True):
        problem, x = problem_of("abc", MODELS["abc"][0], loss)
        along = jnp.zeros_like(x).at[-1].set(1.0)
        assert problem.chart.shared[-1].folds
        slope = lambda y: jax.jvp(lambda z: dense_rows(problem, z), (y,), (along,))[1]  # noqa: E731
        bend = jax.jit(lambda y: jnp.sum(dense_rows(problem, y) * jax.jvp(slope, (y,), (along,))[1]))
        span = Span.cells(problem.samples)
        matrix, curvature = curved_gram(problem, x, span)
        np.testing.assert_allclose(matrix, gram(problem, x, span), rtol=1e-12, atol=1e-14)
        # r'' itself is some hundred times its sum with r
        np.testing.assert_allclose(curvature, [bend(x)], rtol=1e-9)
        residual = gram_residual(problem, span)
        z, jac = residual(x), jax.jacfwd(residual)(x)
        want = np.array(matrix)
        np.testing.assert_allclose(jac.T @ z, want[:-1, -1], rtol=1e-8, atol=1e-14)
        want[len(x) - 1, len(x) - 1] += max(float(curvature[0]), 0.0)
        np.testing.assert_allclose(jac.T @ jac, want[:-1, :-1], rtol=1e-8, atol=1e-13)


def test_a_kink_where_light_and_viewer_change_places():
    """max(n.l, n.v) bends at phi_d = 90 degrees: a row whose values are a polynomial on either side is kept exactly."""
    rng = np.random.default_rng(0)
    phi = (np.arange(60) + 0.5) * np.pi / 60
    weight = rng.uniform(0.5, 1, (2, 3, 60)) * (rng.uniform(size=(2, 3, 60)) > 0.2)
    rules = row_rules(phi, weight, 8)

    def values(at):
        return (1 + at + np.where(at < np.pi / 2, 0.0, (at - np.pi / 2) - 3 * (at - np.pi / 2) ** 3))[None]

    reduced, kept = rules.compress(values(phi)[0] * np.ones((6, 60)))
    np.testing.assert_allclose(reduced, values(rules.phi).reshape(6, 8), rtol=1e-12)
    np.testing.assert_allclose(kept, (weight * values(phi) ** 2).sum(), rtol=1e-12)
    np.testing.assert_allclose((rules.weight * values(rules.phi)[0] ** 2).sum(), kept, rtol=1e-12)


def test_compressed_is_not_summed_twice():
    """A span of cells is the table; the compressed copy before them is another one, of nearly the same cost."""
    with jax.enable_x64(True):
        table, _ = generate("ward-05", grid=(18, 15, 90), noise=[Relative(0.1)], seed=1)
        cells, used = samples(table, 80.0, "solid_angle")
        joined = compress(cells, table, used, 80.0, "solid_angle", LOSSES["log"])
        assert joined.compressed > 0
        chart = charts(MODELS["ward"][0])[0]
        x = jnp.asarray(
            chart.coordinates_of({"diffuse": np.full(3, 0.1), "specular": np.full(3, 0.1), "alpha": np.asarray(0.3)}, 3)
        )
        alone, both = Problem(cells, LOSSES["log"], chart), Problem(joined, LOSSES["log"], chart)
        want = np.asarray(gram(alone, x, Span.cells(cells)))
        np.testing.assert_allclose(gram(both, x, Span.cells(joined)), want, rtol=1e-12, atol=1e-12 * want.max())
        close = np.asarray(gram(both, x, Span.nodes(joined)))
        size = np.sqrt(np.diag(want))
        # eight nodes a row stand for ninety cells: parameters to 1e-5, and so G
        np.testing.assert_allclose(close / size / size[:, None], want / size / size[:, None], atol=1e-4)


def test_factor_of_a_gram_matrix():
    rng = np.random.default_rng(0)
    with jax.enable_x64(True):
        for scale in (1.0, 1e-30, 1e30):
            a = rng.standard_normal((40, 6)) * 10.0 ** rng.uniform(-8, 8, 6) * scale**0.5
            g = a.T @ a
            u = np.asarray(factor(jnp.asarray(g)))
            size = np.sqrt(np.diag(g))
            np.testing.assert_allclose((u.T @ u) / size / size[:, None], g / size / size[:, None], atol=1e-13)


def test_singular_gram():
    """A parameter without effect, and one that repeats another: no Cholesky factor exists, this one does."""
    rng = np.random.default_rng(0)
    a = rng.standard_normal((40, 6))
    a[:, 2] = 0
    a[:, 4] = 3 * a[:, 1]
    g = a.T @ a
    with pytest.raises(np.linalg.LinAlgError):
        np.linalg.cholesky(g)
    with jax.enable_x64(True):
        u = np.asarray(factor(jnp.asarray(g)))
        zero = np.asarray(factor(jnp.zeros((3, 3))))
    assert np.isfinite(u).all()
    np.testing.assert_allclose(u.T @ u, g, atol=1e-13 * g.max())
    np.testing.assert_array_equal(u[:, 2], np.zeros(6))  # nothing of it is rounding, which a solver would follow
    np.testing.assert_array_equal(zero, np.zeros((3, 3)))


def test_undefined_points_are_rejected():
    """1 + f cos <= 0 on a trial step is infinite cost: a search from beside it steps around, and ends where it would."""
    with jax.enable_x64(True):
        problem, _ = problem_of("lambert", MODELS["lambert"][0], "log")
        residual = gram_residual(problem, Span.cells(problem.samples))
        inside, outside = jnp.array([0.1, 0.1]), jnp.array([0.1, -20.0])
        assert np.isnan(np.asarray(gram(problem, outside, Span.cells(problem.samples)))[-1, -1])
        assert float(jnp.sum(residual(outside) ** 2)) > 1e290
        value, tangent = jax.jvp(residual, (outside,), (jnp.ones(2),))
        assert np.isfinite(value).all()
        assert np.isfinite(tangent).all()
        box = Box(jnp.full(2, -50.0), jnp.full(2, 50.0), jnp.ones(2, bool))
        # from a diffuse of 50 under ``log`` the first undamped step goes far below -pi
        far = minimise(residual, jnp.array([50.0, 50.0]), box, jnp.asarray(1e-12), jnp.asarray(1e-3), 200)
        near = minimise(residual, inside, box, jnp.asarray(1e-12), jnp.asarray(1.0), 200)
        assert bool(far.stopped)
        np.testing.assert_allclose(far.x, near.x, rtol=1e-5)
