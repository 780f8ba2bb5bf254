"""The Gram residual: a table of a million cells as a least-squares problem of a handful of rows.

One pass over the blocks accumulates G = [J r]^T [J r], (n+1) x (n+1). With any factor U^T U = G the residual z = U[:, n]
with Jacobian U[:, :n] has z^T z = r^T r, Jz^T Jz = J^T J and Jz^T z = J^T r exactly, so that every solver of the
Gauss-Newton family works on it unchanged, and memory does not grow with the table.

Where the loss treats channels separately, G falls into one small matrix a channel (own and shared coordinates).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ..geometry import Geometry
from ..models import evaluate_channels
from ..polar import PolarTables
from .coordinates import Chart
from .losses import Loss
from .samples import Samples

Vector = Float[Array, " n"]


class Problem(eqx.Module):
    """Everything that is minimised: data, loss and chart. The data is an argument of the compiled program, so that a
    second table of the same shape finds it compiled.
    """

    samples: Samples
    loss: Loss
    chart: Chart = eqx.field(static=True)

    @property
    def channels(self) -> int:
        """Number of channels C."""
        return self.samples.channels

    @property
    def size(self) -> int:
        """Length n of the vector of coordinates."""
        return self.channels * len(self.chart.channel) + len(self.chart.shared)


def _columns(function: Callable[[list[Array]], Any], x: list[Array], twice: Sequence[int] = ()) -> tuple[list[Any], Any]:
    """Derivatives of a function by each coordinate, then second derivatives by the coordinates ``twice``; and its value.

    Coordinates are separate scalars and each derivative is taken with the others held, so that what a coordinate does not
    touch is absent from its program, and what channels share is computed once for all of them. The compiler finds the
    copies of the value equal.
    """

    def slope(k: int, t: Array) -> Any:
        return jax.jvp(lambda t: function([*x[:k], t, *x[k + 1 :]]), (t,), (jnp.ones_like(t),))[1]

    columns = [slope(k, t) for k, t in enumerate(x)]
    columns += [jax.jvp(partial(slope, k), (x[k],), (jnp.ones_like(x[k]),))[1] for k in twice]
    return columns, function(x)


def _root_weight(loss: Loss, g: Geometry, weight: Array) -> Array:
    relative = loss.weight(g)
    return jnp.sqrt(weight if relative is None else weight * relative)


class _Tables(eqx.Module):
    """Functions of one polar angle that a model asks for, with their derivatives in the coordinates that bend them.

    They depend on the coordinates alone, so they are made once a pass. In a block they enter as their first-order
    expansions, which is all that a Jacobian needs.
    """

    x: list[Array]
    values: list[Array]
    slopes: list[list[Array]]

    def near(self, y: list[Array]) -> PolarTables:
        """The tables at coordinates y, to first order."""
        steps = [a - b for a, b in zip(y, self.x, strict=True)]
        return PolarTables([sum((d * s for d, s in zip(ds, steps, strict=True)), v) for v, ds in self._each()])

    def _each(self) -> list[tuple[Array, list[Array]]]:
        return [(v, [d[i] for d in self.slopes]) for i, v in enumerate(self.values)]


def _bending(chart: Chart, own: list[Array], shared: list[Array]) -> list[Array]:
    """The coordinates that the BRDF is not affine in: those that tables of polar angles depend on."""
    pairs = zip((*chart.channel, *chart.shared), (*own, *shared), strict=True)
    return [v for c, v in pairs if not c.linear]


@partial(jax.jit, static_argnums=0)
def _tables(chart: Chart, own: list[Array], shared: list[Array], g: Geometry) -> _Tables:
    """Polar functions of one channel's model."""
    bent = _bending(chart, own, shared)

    def make(y: list[Array]) -> list[Array]:
        given = iter(y)
        o = [v if c.linear else next(given) for c, v in zip(chart.channel, own, strict=True)]
        s = [v if c.linear else next(given) for c, v in zip(chart.shared, shared, strict=True)]
        tables = PolarTables()
        chart.model(o, s).evaluate(replace(g, tables=tables))
        return tables.made

    slopes, values = _columns(make, bent)
    return _Tables(bent, values, slopes)


def polar_tables(problem: Problem, x: Vector) -> _Tables:
    """Polar functions at coordinates x: of every channel, with a leading axis ``[C]``, if channels have lobes of their own,
    of all of them at once if they share theirs.
    """
    own, shared = problem.chart.split(x, problem.channels)
    g, _, _ = problem.samples.block(jnp.zeros((), int))
    tables: _Tables
    if problem.chart.own_lobes:
        tables = jax.vmap(lambda o: _tables(problem.chart, list(o), list(shared), g))(own)
    else:
        tables = _tables(problem.chart, list(own[0]), list(shared), g)
    return tables


# A function compiled within a program is traced once for all places, programs and derivatives that use it, as long as it
# closes over nothing that is itself being traced.


@partial(jax.jit, static_argnums=0)
def _values(chart: Chart, own: list[Array], shared: list[Array], tables: _Tables, g: Geometry) -> Array:
    """BRDF values of one channel."""
    at = replace(g, tables=tables.near(_bending(chart, own, shared)))
    return jnp.broadcast_to(chart.model(own, shared).evaluate(at), g.shape)


@jax.jit
def _residual(loss: Loss, f: Array, measured: Array, g: Geometry, root: Array) -> tuple[Array, Array, Array]:
    """Weighted residual of one channel's values f, and its first and second derivative by them.

    Taken once for all coordinates, and of T(f) where the residual is T(f) - T(m): its divisions would otherwise be done
    again for each column of the Jacobian.
    """

    def residual(f: Array) -> Array:
        return loss(f[..., None], measured[..., None], g)[..., 0]

    transform = loss.transform
    by_value = residual if transform is None else (lambda f: transform(f, g))
    one = jnp.ones_like(f)
    slope, bend = jax.jvp(lambda f: jax.jvp(by_value, (f,), (one,))[1], (f,), (one,))
    return root * residual(f), root * slope, root * bend


@partial(jax.jit, static_argnums=0)
def _joint_residual(
    form: tuple[Chart, int], y: list[Array], tables: _Tables, measured: Array, g: Geometry, loss: Loss, root: Array
) -> tuple[Array, Array]:
    """Weighted residuals ``[m, *cells]`` and BRDF values ``[C, *cells]`` of all channels."""
    chart, channels = form
    own, shared = chart.split(jnp.stack(y), channels)
    axes = (0, 0 if chart.own_lobes else None)
    each: Any = jax.vmap(lambda o, t: _values(chart, list(o), list(shared), t, g), in_axes=axes)
    f = each(own, tables)
    flat_f, flat_m = (jnp.moveaxis(v, 0, -1).reshape(-1, channels) for v in (f, measured))
    r = jnp.asarray(loss(flat_f, flat_m, g.flat())).reshape(root.size, -1)
    return jnp.moveaxis(root.reshape(-1, 1) * r, -1, 0).reshape(-1, *root.shape), f


def channel_rows(
    problem: Problem, x: Vector, tables: _Tables, g: Geometry, measured: Array, weight: Array, twice: Sequence[int] = ()
) -> tuple[Float[Array, "C k+s+q+1 *cells"], Float[Array, " C *cells"]]:
    """Weighted rows [J r] of a block, channel by channel, for a loss that treats channels separately; and the values.

    Between J and r lie the second derivatives by the q shared coordinates ``twice``, counted among the shared ones.
    """
    chart, loss = problem.chart, problem.loss
    own, shared = chart.split(x, problem.channels)
    root = _root_weight(loss, g, weight)

    def stacked(rows: list[Array]) -> Array:
        return jnp.stack([jnp.broadcast_to(a, g.shape) for a in rows])

    def one(own_c: Vector, tables_c: _Tables, measured_c: Array) -> tuple[Array, Array]:
        k = len(own_c)
        at = [k + i for i in twice]
        slopes, f = _columns(lambda y: _values(chart, y[:k], y[k:], tables_c, g), [*own_c, *shared], at)
        r, slope, bend = _residual(loss, f, measured_c, g, root)
        first, second = slopes[: len(slopes) - len(at)], slopes[len(slopes) - len(at) :]
        curved = [d2 * slope + bend * first[i] ** 2 for i, d2 in zip(at, second, strict=True)]
        # all columns times the slope at once: column by column the compiler takes its roots and logarithms anew for each
        return jnp.concatenate([stacked(first) * slope, stacked([*curved, r])]), f

    rows: tuple[Array, Array] = jax.vmap(one, in_axes=(0, 0 if problem.chart.own_lobes else None, 0))(own, tables, measured)
    return rows


def joint_rows(
    problem: Problem, x: Vector, tables: _Tables, g: Geometry, measured: Array, weight: Array, twice: Sequence[int] = ()
) -> tuple[Float[Array, "n+q+1 m *cells"], Float[Array, " C *cells"]]:
    """As :func:`channel_rows`, of all channels at once, for a loss of any form; m residuals a cell."""
    root = _root_weight(problem.loss, g, weight)
    form = problem.chart, problem.channels
    slopes, (r, f) = _columns(
        lambda y: _joint_residual(form, y, tables, measured, g, problem.loss, root),
        list(x),
        [problem.size - len(problem.chart.shared) + i for i in twice],
    )
    return jnp.stack([*(column for column, _ in slopes), r]), f


def _products(rows: Float[Array, " m *cells"]) -> Float[Array, "m m"]:
    """Rows times rows, summed over the cells."""
    r = rows.reshape(rows.shape[0], -1)
    return r @ r.T


def _band_products(rows: Float[Array, " m *cells"], samples: Samples) -> Float[Array, "*bands m m"]:
    """Rows times rows, summed over the cells of each angular band."""
    m, shape = rows.shape[0], samples.banded
    within = [a for a in range(len(shape)) if a not in samples.band_axes]
    r = rows.reshape(m, *shape).transpose(*(a + 1 for a in samples.band_axes), 0, *(a + 1 for a in within))
    r = r.reshape(*(shape[a] for a in samples.band_axes), m, -1)
    return r @ jnp.swapaxes(r, -1, -2)


def _scatter(problem: Problem, per_channel: Float[Array, "C ... k k"]) -> Float[Array, "... n+1 n+1"]:
    """The full Gram matrix from those of the channels."""
    k, c = len(problem.chart.channel), problem.channels
    size = c * k + per_channel.shape[-1] - k
    tail = np.arange(c * k, size)
    out = jnp.zeros((*per_channel.shape[1:-2], size, size))
    for i in range(c):
        at = np.concatenate([np.arange(i * k, (i + 1) * k), tail])
        out = out.at[..., at[:, None], at].add(per_channel[i])
    return out


class Span(eqx.Module):
    """The blocks that a pass visits: ``count`` of them from ``first``. Compressed blocks come before those of cells."""

    first: Int[Any, ""]
    count: Int[Any, ""]

    @staticmethod
    def cells(samples: Samples, count: int | None = None) -> Span:
        """The first ``count`` blocks of cells; all of them by default."""
        return Span(np.asarray(samples.compressed), np.asarray(min(count or samples.blocks, samples.blocks)))

    @staticmethod
    def halves(samples: Samples) -> list[Span]:
        """All blocks of cells in two spans, for two threads; one where there is one block."""
        half = samples.blocks - samples.blocks // 2
        first = np.asarray(samples.compressed)
        spans = [Span(first, np.asarray(half)), Span(first + half, np.asarray(samples.blocks - half))]
        return spans if samples.blocks > 1 else spans[:1]

    @staticmethod
    def nodes(samples: Samples, count: int | None = None) -> Span:
        """The first ``count`` compressed blocks; all of them by default."""
        return Span(np.asarray(0), np.asarray(min(count or samples.compressed, samples.compressed)))


def _sum_over_blocks(samples: Samples, span: Span, one: Callable[[Geometry, Array, Array], Any]) -> Any:
    """Sum of ``one(geometry, measured, weight)``, a pytree of arrays, over a span of blocks."""
    one = jax.jit(one)  # traced once, for its shapes and for the loop

    def step(i: Array, total: Any) -> Any:
        return jax.tree.map(jnp.add, total, one(*samples.block(i)))

    shapes = jax.eval_shape(lambda: one(*samples.block(jnp.zeros((), int))))
    return jax.lax.fori_loop(
        span.first, span.first + span.count, step, jax.tree.map(lambda s: jnp.zeros(s.shape, s.dtype), shapes)
    )


def gram(problem: Problem, x: Vector, span: Span) -> Float[Array, "n+1 n+1"]:
    """G = [J r]^T [J r] over a span of blocks; its last element is the cost, with what compression left out."""
    return _gram(problem, x, span, ())


def curved_gram(problem: Problem, x: Vector, span: Span) -> tuple[Float[Array, "n+1 n+1"], Float[Array, " q"]]:
    """G, and sum w r d^2r/dx^2 of the q coordinates that fold."""
    folds = [i for i, c in enumerate(problem.chart.shared) if c.folds]
    n, q = problem.size, len(folds)
    g = _gram(problem, x, span, tuple(folds))
    kept = np.array([*range(n), n + q])
    return g[kept[:, None], kept], g[n : n + q, -1]


@eqx.filter_jit
def _gram(problem: Problem, x: Vector, span: Span, twice: tuple[int, ...]) -> Float[Array, "n+q+1 n+q+1"]:
    tables = polar_tables(problem, x)

    def one(g: Geometry, measured: Array, weight: Array) -> Array:
        if problem.loss.separable:
            rows = channel_rows(problem, x, tables, g, measured, weight, twice)[0]
            # product by product: a product of all channels at once takes several times as long from five rows on
            return jnp.stack([_products(r) for r in rows])
        return _products(joint_rows(problem, x, tables, g, measured, weight, twice)[0])

    total: Array = _sum_over_blocks(problem.samples, span, one)
    if problem.loss.separable:
        total = _scatter(problem, total)
    if problem.samples.remainder is not None:
        share = jnp.clip(problem.samples.compressed - span.first, 0, span.count) / problem.samples.compressed
        total = total.at[-1, -1].add(share * jnp.sum(problem.samples.remainder))
    return total


class Statistics(NamedTuple):
    """What one pass at an optimum tells; the sum of those of two spans is that of both."""

    bands: Float[Array, "... n+1 n+1"]
    """G of each angular band."""
    middle: Float[Array, "n n"]
    """Sum over cells of s s^T, s = sum_c w r J the gradient of a cell: the middle of the sandwich (White 1980, eq. 3). The
    channels of a cell are summed first, so that noise which they share is counted."""
    sums: Float[Array, "losses 2"]
    """sum w r^2 and sum w of each loss asked for."""


def statistics(problem: Problem, x: Float[Any, " n"], losses: tuple[Loss, ...], span: Span) -> Statistics:
    """What error bars are made of, and the error under each loss, over a span of cells and all channels."""
    n, k, c = problem.size, len(problem.chart.channel), problem.channels
    tables = polar_tables(problem, x)

    def one(g: Geometry, measured: Array, weight: Array) -> tuple[Array, Array, Array]:
        if problem.loss.separable:
            rows, f = channel_rows(problem, x, tables, g, measured, weight)
            s = (rows[:, :-1] * rows[:, -1:]).reshape(c, rows.shape[1] - 1, -1)
            s = jnp.concatenate([s[:, :k].reshape(c * k, -1), jnp.sum(s[:, k:], 0)])
            bands = jax.vmap(lambda r: _band_products(r, problem.samples))(rows)
        else:
            rows, f = joint_rows(problem, x, tables, g, measured, weight)
            s = jnp.sum(rows[:-1] * rows[-1:], 1).reshape(n, -1)
            bands = jnp.sum(jax.vmap(lambda r: _band_products(r, problem.samples), in_axes=1)(rows), 0)
        return bands, s @ s.T, _loss_sums(losses, f, measured, weight, g)

    bands, middle, sums = _sum_over_blocks(problem.samples, span, one)
    bands = _scatter(problem, bands) if problem.loss.separable else bands
    return Statistics(bands, middle, sums)


def factor(g: Float[Array, "m m"]) -> Float[Array, "m m"]:
    """U with U^T U = g, for any symmetric positive semidefinite g, singular ones too.

    By eigenvalues of the matrix scaled to unit diagonal: a Cholesky factor does not exist where a parameter has no effect
    (tests/test_gram.py::test_singular_gram). Eigenvalues below zero are rounding.
    """
    scale = jnp.sqrt(jnp.maximum(jnp.diag(g), 0.0))
    divisor = jnp.where(scale > 0, scale, 1.0)
    values, vectors = jnp.linalg.eigh(g / divisor[:, None] / divisor)
    # not the divisor: the eigenvalue 0 of a parameter without effect is 1e-17, whose root would pass for an effect
    # (tests/test_gram.py::test_singular_gram)
    u: Array = jnp.sqrt(jnp.maximum(values, 0.0))[:, None] * vectors.T * scale
    return u


def gram_residual(problem: Problem, span: Span) -> Callable[[Vector], Array]:
    """The table as a residual of n + 1 rows with an exact Jacobian.

    Where a coordinate folds (:class:`~brdfit.fitting.coordinates.Coordinate`) its column of J vanishes and J^T J knows
    nothing of the curvature sum r r'' of the cost. A further row, of residual 0 and slope sqrt(sum r r''), says it.

    A trial point where the residual is not a number (1 + f cos <= 0 under ``log``) has infinite cost: it is rejected, and
    the factors of a finite matrix are returned in its place so that no NaN reaches the solver.
    """
    # traced here, once: inside a solver every use of it would be
    one_pass: Any = eqx.filter_closure_convert(partial(curved_gram, problem, span=span), jnp.zeros(problem.size))
    first = problem.size - len(problem.chart.shared)
    folds = np.array([first + i for i, c in enumerate(problem.chart.shared) if c.folds], int)

    def whiten(x: Vector) -> Array:
        g, curvature = one_pass(x)
        ok = jnp.all(jnp.isfinite(g)) & jnp.all(jnp.isfinite(curvature))
        g = jnp.where(ok, g, jnp.eye(g.shape[0]))
        rows = jnp.zeros((len(folds), len(g))).at[np.arange(len(folds)), folds].set(jnp.sqrt(jnp.maximum(curvature, 0.0)))
        return jnp.concatenate([jnp.where(ok, 1.0, 1e150) * factor(g), jnp.where(ok, rows, 0.0)])

    @jax.custom_jvp
    def residual(x: Vector) -> Array:
        return whiten(x)[:, -1]

    @residual.defjvp
    def _(primals: tuple[Any], tangents: tuple[Any]) -> tuple[Array, Array]:
        u = whiten(primals[0])
        return u[:, -1], u[:, :-1] @ tangents[0]

    return residual


def _loss_sums(
    losses: tuple[Loss, ...], f: Float[Array, " C *cells"], measured: Float[Array, " C *cells"], weight: Array, g: Geometry
) -> Float[Array, "losses 2"]:
    """sum w r^2 and sum w of each loss over a block."""
    out = [jnp.zeros((0, 2))]
    for loss in losses:
        relative = loss.weight(g)
        w = jnp.broadcast_to(weight if relative is None else weight * relative, weight.shape)
        if loss.separable:  # channel by channel, as the values lie in memory
            each: Any = jax.vmap(lambda p, m, loss=loss: loss(p[..., None], m[..., None], g)[..., 0])
            r = each(f, measured)
        else:
            p, m = (jnp.moveaxis(v, 0, -1).reshape(w.size, -1) for v in (f, measured))
            r = jnp.moveaxis(jnp.asarray(loss(p, m, g.flat())).reshape(*w.shape, -1), -1, 0)
        # a product, not a sum: the compiler takes the terms of a sum one by one, those of a product in vectors
        squares = (r**2).reshape(len(r), -1) @ w.reshape(-1)
        out.append(jnp.stack([jnp.sum(squares), jnp.sum(w) * len(r)])[None])
    return jnp.concatenate(out)


def loss_errors(model: Any, samples: Samples, losses: tuple[Loss, ...]) -> Float[Array, " losses"]:
    """sqrt(sum w r^2 / sum w) of each loss over all fitted cells and channels."""

    def one(g: Geometry, measured: Array, weight: Array) -> Array:
        f = jnp.moveaxis(evaluate_channels(model, g), -1, 0)
        return _loss_sums(losses, jnp.broadcast_to(f, measured.shape), measured, weight, g)

    sums = _sum_over_blocks(samples, Span.cells(samples), one)
    return jnp.sqrt(sums[:, 0] / sums[:, 1])
