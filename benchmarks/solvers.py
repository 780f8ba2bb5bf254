"""One whole-table fit by the solvers that a user would pick, side by side: makes docs/solvers.md.

    python benchmarks/solvers.py FILE [--models gtr,abc,sgd,ward,ashikhmin_shirley] [--repeats 5] [--out docs/solvers.md]

All minimise the same residuals (loss ``log``, solid-angle measure, 80 degrees) in the same coordinates from the same start:
SciPy's trust-region reflective solver with finite differences, as it comes, and with the Jacobian from JAX; Optimistix'
Levenberg-Marquardt as it comes; this package on every cell and on the compressed table. A model whose channels have nothing
in common is fitted in one channel. SciPy and stock Optimistix run once; the others are interleaved and repeated.
"""

from __future__ import annotations

import argparse
import os
import platform
import statistics
import time
from collections.abc import Callable
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any

import brdfit
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
import scipy.optimize
from brdfit.fitting.coordinates import charts
from brdfit.fitting.given import model_class
from brdfit.fitting.gram import Problem, Span, gram
from brdfit.fitting.prepared import prepare
from brdfit.fitting.search import Stage, solve
from brdfit.fitting.solver import Box
from brdfit.fitting.starts import starts
from brdfit.fitting.threads import in_threads
from brdfit.models import evaluate_channels
from brdfit.polar import PolarStencil
from brdfit.programs import program

LIMIT = float(np.radians(80))
whole_pass = program(gram)


def timed(run: Callable[[], Any]) -> tuple[float, Any]:
    """Seconds and result, once the device is done."""
    begin = time.perf_counter()
    result = jax.block_until_ready(run())
    return time.perf_counter() - begin, result


def dense(problem: Problem) -> tuple[Any, Any]:
    """``residual(x, data) -> [n]`` over all fitted cells and channels, and its data."""
    cells = problem.samples.cells
    count = cells.weight.shape[0]
    blocks = [cells.at(jnp.asarray(i)) for i in range(count)]
    g = jax.tree.map(lambda *leaves: jnp.concatenate(leaves), *(b[0].flat() for b in blocks))
    m = np.concatenate([np.asarray(b[1]).reshape(problem.channels, -1) for b in blocks], 1)
    w = np.concatenate([np.asarray(b[2]).ravel() for b in blocks])
    used = np.flatnonzero(w)
    g = jax.tree.map(lambda leaf: leaf[used], g)
    # Smith's integral from a table of polar angles, as the package has it: on every cell it would take forty gigabytes
    stencils = (PolarStencil.of(np.asarray(c), LIMIT) for c in (g.cos_i, g.cos_o))
    g = replace(g, **dict(zip(("stencil_i", "stencil_o"), stencils, strict=True)))
    data = jax.tree.map(jnp.asarray, g), jnp.asarray(m[:, used].T), jnp.sqrt(jnp.asarray(w[used]))

    @jax.jit
    def residual(x, data):
        g, measured, root = data
        own, shared = problem.chart.split(x, problem.channels)
        f = jax.vmap(lambda o: jnp.broadcast_to(problem.chart.model(o, shared).evaluate(g), root.shape), out_axes=-1)(own)
        return (root[:, None] * problem.loss(f, measured, g)).reshape(-1)

    return residual, data


def compare(table: brdfit.Table, name: str, repeats: int) -> dict[str, Any]:
    """Seconds and costs of every way to fit one model."""
    ready = prepare(table)
    chart = charts(model_class(name, anisotropic=False))[0]
    samples = ready.samples if chart.shared else ready.samples.channel(0)
    problem = Problem(samples, ready.loss, chart)
    channels = problem.channels
    lower, upper = chart.box(channels)
    box = Box(lower, upper, np.ones(len(lower), bool))
    linear = np.array([c.linear for c, _ in chart.vector(channels)])
    fit = brdfit.fit(table, name)
    best = fit.errors["log"] ** 2 * (channels if chart.shared else 1)

    def colours(shape):
        x = chart.coordinates_of({n: v if v.ndim == 0 else v[:channels] for n, v in shape.items()}, channels)
        return solve(problem, x, replace(box, free=linear), Stage.of(Span.nodes(samples), 1e-6, 1e-2))

    # the start: the first shape from which the fast path reaches its best optimum
    ends = [
        (c, solve(problem, c.x, box, Stage.of(Span.nodes(samples), 1e-9, 1.0)))
        for c in map(colours, starts(chart.cls, ready.summary, 0))
    ]
    least = min(float(e.cost) for _, e in ends)
    x0 = next(np.asarray(c.x) for c, e in ends if float(e.cost) <= least * (1 + 1e-6))

    residual, data = dense(problem)
    jac = jax.jit(lambda x, d: jax.jacfwd(lambda y: residual(y, d))(x))
    cost = lambda x: float(jnp.sum(residual(jnp.asarray(x), data) ** 2))  # noqa: E731
    inside = np.clip(x0, lower + 1e-9, np.where(np.isfinite(upper), upper - 1e-9, upper))
    out: dict[str, Any] = {"model": name, "coordinates": len(x0), "residuals": int(data[1].size), "best": best}

    options = {"bounds": (lower, upper), "x_scale": "jac", "ftol": 1e-9, "xtol": 1e-12, "gtol": 1e-12}
    flat = lambda x: np.asarray(residual(jnp.asarray(x), data))  # noqa: E731
    slopes = lambda x: np.asarray(jac(jnp.asarray(x), data))  # noqa: E731
    flat(inside), slopes(inside)
    seconds, r = timed(lambda: scipy.optimize.least_squares(flat, inside, **options))
    out["SciPy TRF, finite differences"] = [seconds], cost(r.x)
    seconds, r = timed(lambda: scipy.optimize.least_squares(flat, inside, jac=slopes, **options))
    out["SciPy TRF, JAX Jacobian"] = [seconds], cost(r.x)

    stock = optx.LevenbergMarquardt(rtol=1e-9, atol=1e-9)
    run = eqx.filter_jit(lambda x, d: optx.least_squares(residual, stock, x, d, max_steps=300, throw=False).value)
    compiled = run.lower(jnp.asarray(inside), data).compile()
    seconds, x = timed(lambda: compiled(jnp.asarray(inside), data))
    out["Optimistix LM as it comes"] = [seconds], cost(np.clip(x, lower, upper))

    exact = Stage.of(Span.cells(samples), 1e-9, 1.0)
    fast = Stage.of(Span.nodes(samples), 1e-9, 1.0)

    def data_pass():
        fresh = replace(table)  # nothing is kept for it yet
        prepared = prepare(fresh).samples
        return (prepared if chart.shared else prepared.channel(0)).nodes.measured

    pieces = {
        "exact": lambda: solve(problem, x0, box, exact),
        "solve": lambda: solve(problem, x0, box, fast),
        "data": data_pass,
        "pass": lambda: list(in_threads(lambda span: whole_pass(problem, x0, span), Span.halves(samples))),
    }
    model = chart.cls(**{n: v[:channels] if v.ndim else v for n, v in fit.parameters.items()})
    tabulated = brdfit.ready(model)
    call, bare = jax.jit(lambda m, wi, wo: m(wi, wo)), jax.jit(evaluate_channels)
    g, w = data[0], [jnp.asarray(v[ready.used]) for v in table.layout.directions()]
    pieces |= {"call": lambda: call(tabulated, *w), "bare": lambda: bare(model, g)}
    times: dict[str, list[float]] = {k: [] for k in pieces}
    results = {}
    for repeat in range(repeats + 1):
        for key, piece in pieces.items():
            seconds, results[key] = timed(piece)
            if repeat:  # the first one compiles
                times[key].append(seconds)
    out["every cell"] = times["exact"], cost(results["exact"].x)
    out["compressed"] = [a + b for a, b in zip(times["data"], times["solve"], strict=True)], cost(results["solve"].x)
    out |= {key: times[key] for key in ("data", "solve", "pass", "call", "bare")}
    return out


PIECES = ("data", "solve", "pass", "call", "bare")
WAYS = ("SciPy TRF, finite differences", "SciPy TRF, JAX Jacobian", "Optimistix LM as it comes", "every cell", "compressed")


def page(table: brdfit.Table, results: list[dict[str, Any]]) -> str:
    """The page as Markdown."""

    def spread(seconds: list[float]) -> str:
        middle = statistics.median(seconds)
        return f"{middle:.3g}" + (f" ({min(seconds):.2g} to {max(seconds):.2g})" if len(seconds) > 1 else "")

    lines = [
        "# One whole-table fit, by several solvers",
        "",
        f"{table.material}, made on {date.today().isoformat()} by `python benchmarks/solvers.py FILE --out docs/solvers.md`",
        f"({os.cpu_count()} cores, {platform.machine()}, JAX {jax.__version__}, SciPy {scipy.__version__}).",
        "Seconds, warm: median (least to most); in brackets the cost relative to the lowest. The last two are this package:",
        "every cell in every step; and one data pass that compresses the table, then the solve. All from the same start.",
        "",
        "| model | residuals | coordinates | " + " | ".join(WAYS) + " |",
        "|---|---|---|" + "---|" * len(WAYS),
    ]
    for r in results:
        least = min(r[w][1] for w in WAYS)
        cells = [f"{spread(r[w][0])} [{r[w][1] / least - 1:+.0e}]" for w in WAYS]
        lines.append(f"| {r['model']} | {r['residuals']:,} | {r['coordinates']} | " + " | ".join(cells) + " |")
    lines += [
        "",
        "Where the time goes, beside one evaluation of the fitted model on the fitted cells as separate directions: as",
        "users call it, `ready(model)(wi, wo)`, and its formula alone, with cosines and positions in tables given. A gram",
        "pass is residuals, Jacobian and normal equations over every cell. It takes two threads, as passes do in which a",
        "fit asks every cell; evaluations take all cores. The solve takes one, so that fits run side by side.",
        "",
        "| model | data pass | solve | gram pass | `ready(model)(wi, wo)` | formula alone |",
        "|---|---|---|---|---|---|",
    ]
    lines += [f"| {r['model']} | " + " | ".join(spread(r[k]) for k in PIECES) + " |" for r in results]
    lines += [
        "",
        "| model | SciPy TRF / (data pass + solve) | SciPy TRF / solve | (data pass + solve) / `ready(model)(wi, wo)` | "
        "gram pass / `ready(model)(wi, wo)` | (data pass + solve) / formula | gram pass / formula |",
        "|---|---|---|---|---|---|---|",
    ]
    for r in results:
        m = {k: statistics.median(r[k]) for k in PIECES}
        scipy_trf, total = r[WAYS[0]][0][0], statistics.median(r["compressed"][0])
        ratios = [f"{scipy_trf / total:.0f}", f"{scipy_trf / m['solve']:.0f}"]
        ratios += [f"{a / m[k]:.2g}" for k in ("call", "bare") for a in (total, m["pass"])]
        lines.append(f"| {r['model']} | " + " | ".join(ratios) + " |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Parse, measure, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=Path)
    parser.add_argument("--models", default="gtr,abc,sgd,ward,ashikhmin_shirley")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    table = brdfit.load(args.file)
    with jax.enable_x64(True):
        text = page(table, [compare(table, name, args.repeats) for name in args.models.split(",")])
    if args.out:
        args.out.write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
