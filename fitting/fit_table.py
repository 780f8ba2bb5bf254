"""Fit a model to a table: starts, search, error bars, and the story of how it went."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Literal

import jax
import numpy as np
from jaxtyping import ArrayLike

from ..models import BRDF, channels
from ..tables import Table
from .coordinates import Chart, charts, into
from .effort import DEFAULT, Effort
from .estimate import Judgement, errors_of, judge, make_ready
from .given import (
    Model,
    check_azimuth,
    check_bounds,
    check_names,
    check_table,
    given_start,
    model_class,
    name_of,
    per_channel,
)
from .gram import Problem, Span
from .losses import LOSSES, Loss, LossFunction, check_loss, named_loss
from .plan import RUNGS, plan
from .prepared import at_hand, prepare
from .result import EXACT_FIT, Fit, Named, Optimum
from .samples import Samples
from .search import Found, Stage, search, solve
from .solver import Box, Minimum
from .spike import is_spike, peak, spike_warning
from .starts import starts
from .threads import in_threads
from .timing import compilation

OPTIMAL = 1e-4
"""Cosine between residual and Jacobian below which a point counts as a first-order optimum: moving there would lower the
error by less than half the square of it, 5e-9 relative."""
TOLERATED = 0.1
"""Standard errors by which compression of the table may move a parameter."""
EXACT = 1e-8
"""Error, relative to what the parameters do to the residual, below which a fit is exact: polar tables are good to 3e-9."""
BLACK = 1e-14
"""Error below which a fit is exact whatever the parameters: a black channel has nothing to be small against."""


def fit(
    table: Table,
    model: Model = "gtr",
    *,
    loss: str | Loss | LossFunction = "log",
    measure: str = "solid_angle",
    max_angle: float = 80.0,
    fixed: Mapping[str, ArrayLike] | None = None,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    start: Mapping[str, ArrayLike] | Literal["published"] | None = None,
    anisotropic: bool | None = None,
    seed: int = 0,
    effort: Effort = DEFAULT,
    tolerance: float | None = None,
    time_budget: float | None = None,
) -> Fit:
    """Fit one model to all cells of one table, in float64.

    Args:
        table: What was measured.
        model: A name of ``brdfit.models.MODELS``, a model class, or an instance, whose values are then one more start.
        loss: A name of ``brdfit.fitting.LOSSES`` or any JAX-traceable ``loss(predicted [n, C], measured [n, C], geometry)
            -> residual``; the sum of weight * residual^2 is minimised.
        measure: ``"solid_angle"``, a cell counts by its solid angles, or ``"cells"``, every cell counts once.
        max_angle: Largest polar angle of either direction, degrees, in (0, 90).
        fixed: Parameters to hold at given values, ``[]`` or ``[C]``.
        bounds: ``(lower, upper)`` in place of a parameter's default search box.
        start: Parameters of one more start; those left out are as in the first shape. Or "published": the published fit of
            the model to the material, by its name, if there is one.
        anisotropic: Whether to fit the anisotropic form of a named model; by default if the table is anisotropic.
        seed: Seed of the starts of models that have no shapes of their own to start from.
        effort: Settings that trade time for accuracy.
        tolerance: In place of ``effort`` the cheapest settings predicted to keep the error within this share of the best
            fit's, in (0, 1). Where all cells then see more than half of it left to gain, better settings follow.
        time_budget: In place of ``effort`` the best settings predicted to prepare and fit the table in so many seconds,
            nothing compiled. :attr:`Fit.plan` says what was predicted.

    Returns:
        A :class:`Fit`. A fit that failed is a result with ``converged`` False and the ``reason`` in words.

    Raises:
        ValueError: Unknown model, loss, measure or parameter name, a value out of range, or a loss of the wrong form.
        InputError: An anisotropic model, and the table is isotropic.
        TypeError: A table, model or loss that is neither a name nor the right kind of object.
    """
    check_table(table)
    cls = model_class(model, (not table.isotropic) if anisotropic is None else anisotropic)
    if table.isotropic:
        check_azimuth(cls, table.source or table.material)
    minimised = named_loss(loss)
    if minimised.name not in LOSSES:
        with jax.enable_x64(True):
            check_loss(minimised, table.channels)
    options: dict[str, Any] = {
        "loss": minimised,
        "measure": measure,
        "max_angle": max_angle,
        "fixed": fixed or {},
        "bounds": bounds or {},
        "start": start,
        "anisotropic": anisotropic,
        "seed": seed,
    }
    if tolerance is None and time_budget is None:
        return _fit(table, model, effort=effort, **options)
    cells = int(prepare(table, max_angle, measure, options["loss"]).used.sum())
    chosen = plan(name_of(cls), cells, tolerance, time_budget)
    spent = {"compile": 0.0, "solve": 0.0}
    while True:
        found = _fit(table, model, effort=RUNGS[chosen.rung], **options)
        spent = {piece: t + found.seconds[piece] for piece, t in spent.items()}
        if tolerance is None or not found.gain > tolerance / 2 or chosen.rung == len(RUNGS) - 1:
            return replace(found, plan=chosen, seconds={**found.seconds, **spent})
        chosen = plan(name_of(cls), cells, tolerance, time_budget, lowest=chosen.rung + 1)


def _fit(
    table: Table,
    model: Model,
    *,
    loss: Loss,
    measure: str,
    max_angle: float,
    fixed: Mapping[str, ArrayLike],
    bounds: Mapping[str, tuple[float, float]],
    start: Mapping[str, ArrayLike] | str | None,
    anisotropic: bool | None,
    seed: int,
    effort: Effort,
) -> Fit:
    """As :func:`fit`, with settings that are known."""
    cls = model_class(model, (not table.isotropic) if anisotropic is None else anisotropic)
    held: Named = {n: np.asarray(v, float) for n, v in fixed.items()}
    given = given_start(cls, model, start, table)
    check_names(cls, {**held, **given, **dict(bounds)})
    check_bounds(cls, bounds)
    with jax.enable_x64(True), compilation() as compiled:
        ready = prepare(table, max_angle, measure, loss, effort)
        used, bound_loss = ready.used, ready.loss
        prepared, early = time.perf_counter(), compiled.away
        frame: dict[str, Any] = {
            "material": table.material,
            "source": table.source,
            "sha256": table.sha256,
            "angles": table.angles,
            "model_name": name_of(cls),
            "loss": bound_loss.name,
            "measure": measure,
            "max_angle": max_angle,
            "fixed": tuple(held),
            "cells": {"used": int(used.sum()), "masked": int((~table.mask).sum()), "total": int(used.size)},
        }
        if not used.any():
            reason = f"no measured cell has both polar angles within {max_angle:g} degrees: nothing to fit"
            seconds = {"load": table.seconds, "prepare": ready.seconds, "compile": compiled.seconds, "solve": 0.0}
            return _nothing(frame, reason, seconds)
        forms = charts(cls, plain=bool(held or bounds))
        every = list(starts(cls, ready.summary, seed))
        count = max(math.ceil(effort.shapes * len(every)), 0 if given else 1)
        proposals = [every[i * len(every) // count] for i in range(count)]
        if given:
            proposals.insert(0, {**every[0], **per_channel(cls, given, table.channels)})
        proposals = [{**p, **per_channel(cls, held, table.channels)} for p in proposals]
        named = ready.losses

        def last(first: BRDF) -> None:
            if effort.error_bars:
                make_ready(Problem(ready.samples, bound_loss, forms[0]), named)
            peak(first)

        in_threads(last, [cls(**proposals[0])])  # compiled by one thread while the others search
        found = _search(forms, ready.samples, bound_loss, proposals, frozenset(held), bounds, effort)
        found, judged = settle(found, Problem(ready.samples, bound_loss, found[0].problem.chart), named, effort)
        errors = dict(zip((e.name for e in named), map(float, judged.errors), strict=True))
    warnings = []
    if start == "published" and not given:
        warnings.append("no published fit of this model to this material is known: it started from the data alone")
    model = cls(**judged.estimate.parameters)
    if is_spike(model, ready.largest):
        warnings.append(spike_warning(peak(model), ready.largest, bound_loss.name))
    converged, reason = _verdict(found, effort.rtol)
    solve = time.perf_counter() - prepared - (compiled.away - early)
    return Fit(
        **frame,
        **vars(judged.estimate),
        model=model,
        converged=converged,
        reason=reason,
        errors=errors,
        warnings=tuple(warnings),
        seconds={
            "load": table.seconds,
            "prepare": ready.seconds,
            "compile": compiled.seconds,
            "solve": max(solve, 0.0),
        },
        starts=found[0].starts,
        optima=_scaled(found, errors[bound_loss.name]),
        passes=max(f.passes for f in found),
        path="exact" if any(f.exact for f in found) else "compressed",
        shift=float(judged.shift.max(initial=0.0)),
        gain=0.0 if all(_exact(f.minimum) for f in found) else judged.gain,
        effort=effort,
    )


def settle(found: list[Found], whole: Problem, losses: tuple[Loss, ...], effort: Effort) -> tuple[list[Found], Judgement]:
    """Optima, of all channels or of each, judged by the whole table.

    An optimum of the compressed table stands if the cells themselves, asked with one exact Gauss-Newton step, would move
    no parameter by more than :data:`TOLERATED` standard errors. Otherwise, if ``effort`` leaves it open, the search ends on
    the cells.
    """

    def judged(found: list[Found]) -> Judgement:
        x = np.concatenate([np.asarray(f.minimum.x) for f in found])
        boxes = [(f.box.lower, f.box.upper, f.box.free) for f in found]
        box = Box(*(np.concatenate([np.asarray(b) for b in side]) for side in zip(*boxes, strict=True)))
        cost = sum(float(f.minimum.cost) for f in found) if by_rows else None
        return judge(whole, x, box, losses, effort.error_bars, cost)

    by_rows = effort.errors == "rows" and not any(f.exact for f in found)
    if not by_rows:
        found = [replace(f, passes=f.passes + 1) for f in found]
    judgement = judged(found)
    again = False
    for i, shift in enumerate(np.split(judgement.shift, len(found))):
        f = found[i]
        if effort.path == "auto" and not f.exact and shift.max(initial=0.0) > TOLERATED:
            stage = Stage.of(Span.cells(f.problem.samples), effort.rtol, 1e-6)
            end = solve(f.problem, f.minimum.x, f.box, stage)
            found[i] = replace(f, minimum=end, passes=f.passes + int(end.steps) + 1, exact=True)
            again = True
    return found, judged(found) if again else judgement


def evaluate(
    table: Table, model: BRDF, *, measure: str = "solid_angle", max_angle: float = 80.0, loss: LossFunction | None = None
) -> dict[str, float]:
    """Error of any model on a table under every named loss, as fits report it, without fitting anything.

    sqrt(sum w r^2 / sum w) over the cells with both polar angles at most ``max_angle`` degrees and all channels; with
    ``loss`` also under a loss of your own. Use it to see how a published fit or another tool's result does.

    Raises ValueError if the model has neither one channel nor as many as the table, TypeError for what is no table or model.
    """
    check_table(table)
    if not isinstance(model, BRDF):
        raise TypeError(f"evaluate takes a model with parameters (brdfit.model, fit.model), not {model!r}")
    if channels(model) not in (1, table.channels):
        raise ValueError(f"the model has {channels(model)} channels and the table {table.channels}")
    own = None if loss is None else named_loss(loss)
    with jax.enable_x64(True):
        exact = replace(DEFAULT, path="exact")
        ready = at_hand(table, max_angle, measure, own) or prepare(table, max_angle, measure, own or LOSSES["log"], exact)
        named = tuple(x for x in ready.losses if own is not None or x.name in LOSSES)
        values = np.asarray(errors_of(model, ready.samples, named))
    return {e.name: float(v) for e, v in zip(named, values, strict=True)}


def _search(
    forms: tuple[Chart, ...],
    blocks: Samples,
    loss: Loss,
    proposals: list[Named],
    fixed: frozenset[str],
    bounds: Mapping[str, tuple[float, float]],
    effort: Effort,
) -> list[Found]:
    """Best optimum of the whole problem, or of each channel where nothing ties the channels together."""
    channels = blocks.channels
    apart = loss.separable and len(forms) == 1 and not forms[0].shared and channels > 1
    found = []
    for part in [[c] for c in range(channels)] if apart else [list(range(channels))]:
        cells = blocks.channel(part[0]) if apart else blocks
        problems = []
        mine = [{n: v if v.ndim == 0 else v[part] for n, v in p.items()} for p in proposals]
        for chart in forms:
            lower, upper = chart.box(len(part), bounds)
            held = np.array([c.parameter in fixed for c, _ in chart.vector(len(part))])
            exact = chart.vectors(mine, len(part))
            begin = np.where(held, exact, into(exact, lower, upper))
            # a held parameter may lie outside the box that a fit searches
            lower = np.where(held, np.minimum(lower, begin[0]), lower)
            upper = np.where(held, np.maximum(upper, begin[0]), upper)
            distinct = [x for i, x in enumerate(begin) if not any(np.array_equal(x, y) for y in begin[:i])]
            problems.append((Problem(cells, loss, chart), Box(lower, upper, ~held), distinct))
        found.append(search(problems, effort))
    return found


def _scaled(found: list[Found], error: float) -> tuple[Optimum, ...]:
    """Distinct optima with their costs turned into errors of the loss; of the channel with most optima, if apart."""
    optima = max((f.optima for f in found), key=len)
    best = optima[0].error or 1.0
    return tuple(Optimum(o.error / best * error, o.starts) for o in optima)


def _verdict(found: list[Found], rtol: float) -> tuple[bool, str]:
    """Whether the fit converged, and why it stopped, in words; the worst channel speaks for all."""
    return min((_ending(f.minimum, rtol) for f in sorted(found, key=lambda f: -float(f.minimum.cost))), key=lambda v: v[0])


def _exact(end: Minimum) -> bool:
    """Whether the error is rounding, of which nothing can be gained."""
    return float(np.sqrt(end.cost)) <= max(EXACT * float(end.scale), BLACK)


def _ending(end: Minimum, rtol: float) -> tuple[bool, str]:
    error, cosine, steps = float(np.sqrt(end.cost)), float(end.optimality), int(end.steps)
    if not np.isfinite(error) or error > 1e140:
        return False, "no start gave a finite error: the model or the loss is not defined where the data are"
    if _exact(end):
        return True, f"{EXACT_FIT}: the error is {error:.1g}, which is rounding"
    if not bool(end.stopped):
        return False, f"stopped at the limit of {steps} steps; the gradient is still {cosine:.1g} (cosine to the residual)"
    if cosine > max(OPTIMAL, math.sqrt(rtol)):
        return False, f"stalled after {steps} steps: no step lowers the error, but the gradient is {cosine:.1g}, not 0"
    return True, f"at a minimum: the last step changed the cost by less than {rtol:g} of itself, gradient {cosine:.1g}"


def failed(material: str, model: Model, reason: str, options: Mapping[str, Any]) -> Fit:
    """The result of a fit that could not even begin."""
    cls = model_class(model, anisotropic=False)
    frame = {
        "material": material,
        "source": "",
        "sha256": "",
        "angles": "",
        "model_name": name_of(cls),
        "loss": named_loss(options.get("loss", "log")).name,
        "measure": options.get("measure", "solid_angle"),
        "max_angle": options.get("max_angle", 80.0),
        "cells": {"used": 0, "masked": 0, "total": 0},
    }
    return _nothing(frame, reason, dict.fromkeys(("load", "prepare", "compile", "solve"), 0.0))


def _nothing(frame: dict[str, Any], reason: str, seconds: dict[str, float]) -> Fit:
    return Fit(
        **frame,
        model=None,
        parameters={},
        stderr={},
        spread={},
        covariance={},
        converged=False,
        reason=reason,
        errors={n: float("nan") for n in LOSSES},
        seconds=seconds,
    )
