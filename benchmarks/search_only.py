"""A fit without error bars: the search of ``brdfit.fit`` alone, for comparisons that make thousands of fits.

The optimum is that of the table compressed along phi_d. ``brdfit.fit`` then asks every cell, with one exact step, whether it
agrees, and goes on with the cells if not; that takes most of its time. Here the cells are only asked for the error, and
only on request.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import brdfit
import jax
import numpy as np
from brdfit.fitting.coordinates import charts
from brdfit.fitting.effort import Effort
from brdfit.fitting.fit_table import Prepared, _search, _verdict, model_class, prepare
from brdfit.fitting.gram import loss_errors
from brdfit.fitting.losses import Loss, named_loss
from brdfit.fitting.search import Found
from brdfit.fitting.starts import starts
from brdfit.fitting.timing import compilation
from brdfit.models import build, parameters_of
from brdfit.programs import program

_errors = program(loss_errors)


@dataclass(frozen=True)
class Search:
    """What a search found."""

    model: brdfit.BRDF
    error: float
    """sqrt(sum w r^2 / sum w) of the fitted loss over the compressed table."""
    of_cells: dict[str, float]
    """The same over all cells, under each loss asked for."""
    at_bound: tuple[str, ...]
    """Parameters at a bound of what is searched, as ``alpha`` or ``diffuse[0]``."""
    converged: bool
    reason: str
    seconds: float
    """Of the search, nothing compiled."""


def search(
    table: brdfit.Table,
    name: str,
    loss: str | Loss,
    effort: Effort,
    start: Mapping[str, np.ndarray] | None = None,
    cells: Sequence[str | Loss] = (),
) -> Search:
    """The best optimum of a model from its automatic starts, or from ``start`` alone: arrays ``[]`` or ``[C]``.

    ``cells`` are the losses whose errors over all cells are wanted, none that has to be bound to the table.
    """
    cls = model_class(name, anisotropic=False)
    with jax.enable_x64(True), compilation() as compiled:
        ready = prepare(table, loss=named_loss(loss), effort=effort)
        begin, early = time.perf_counter(), compiled.seconds
        if start is None:
            proposals = list(starts(cls, ready.summary, 0))
            count = math.ceil(effort.shapes * len(proposals))
            proposals = [proposals[i * len(proposals) // count] for i in range(count)]
        else:
            proposals = [dict(start)]
        found = _search(charts(cls), ready.samples, ready.loss, proposals, frozenset(), effort)
        seconds = time.perf_counter() - begin - (compiled.seconds - early)
        rows = [row for f in found for row in _parameters(f)]
        values = {p.name: [r[p.name] for r in rows] if p.per_channel else rows[0][p.name] for p in parameters_of(cls)}
        model = build(cls, values)
        named = tuple(named_loss(c) for c in cells)
        errors = _errors(model, ready.samples, named) if named else []
        error = math.sqrt(sum(float(f.minimum.cost) for f in found) / (table.channels * _weights(ready)))
    converged, reason = _verdict(found, effort.rtol)
    of_cells = {c.name: float(e) for c, e in zip(named, errors, strict=True)}
    return Search(model, error, of_cells, tuple(_at_bound(found)), converged, reason, max(seconds, 0.0))


def _parameters(f: Found) -> list[dict[str, float]]:
    """Parameters of each channel of an optimum."""
    # a bound is reached by adding the step that leads to it, and so to the last bit only
    x = np.clip(f.minimum.x, f.box.lower, f.box.upper)
    own, shared = f.problem.chart.split(x, f.problem.channels)
    return [{n: float(v) for n, v in f.problem.chart.parameters(o, shared).items()} for o in own]


def _at_bound(found: list[Found]) -> list[str]:
    names = []
    for k, f in enumerate(found):
        x = np.asarray(f.minimum.x)
        ends = (x <= f.box.lower) | (x >= f.box.upper)
        for (c, channel), end in zip(f.problem.chart.vector(f.problem.channels), ends, strict=True):
            if end:
                names.append(c.parameter if channel is None else f"{c.parameter}[{channel + k}]")
    return names


def _weights(ready: Prepared) -> float:
    """Sum of the weights, those of the loss included, over the table that is searched."""
    blocks = ready.samples.nodes or ready.samples.cells
    relative = ready.loss.weight(blocks.geometry)
    return float((blocks.weight if relative is None else blocks.weight * relative).sum())


__all__ = ["Search", "search"]
