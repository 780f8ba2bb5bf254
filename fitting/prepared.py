"""A table made ready for fits under one loss, kept for the next model that is fitted to it."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass
from typing import Any
from weakref import WeakKeyDictionary

import jax
import numpy as np
from numpy.typing import NDArray

from ..tables import Table
from .effort import DEFAULT, Effort
from .grid_samples import compress
from .losses import LOSSES, Loss
from .samples import Samples, samples
from .spike import largest_value
from .starts import Summary, summarise
from .threads import in_threads
from .timing import compilation


@dataclass(frozen=True)
class Prepared:
    """A table made ready for fits under one loss."""

    samples: Samples
    used: NDArray[np.bool_]
    """Which cells are fitted."""
    summary: Summary
    loss: Loss
    """The loss, bound to the table."""
    losses: tuple[Loss, ...]
    """Every loss that errors are reported under, bound to the table."""
    largest: float
    """The largest measured value, 1/sr."""
    seconds: float
    """What that took, nothing compiled: for all fits that share it."""


_prepared: WeakKeyDictionary[Table, dict[Any, Prepared]] = WeakKeyDictionary()
_preparing = threading.Lock()


def prepare(
    table: Table,
    max_angle: float = 80.0,
    measure: str = "solid_angle",
    loss: Loss = LOSSES["log"],
    effort: Effort = DEFAULT,
) -> Prepared:
    """Blocks, fitted cells and summary of a table, kept for the next model fitted to it."""
    compressed = effort.path != "exact"
    key = (max_angle, measure, loss, effort.nodes, compressed)
    with jax.enable_x64(True), _preparing:
        kept = _prepared.setdefault(table, {})
        if key in kept:
            return kept[key]
        with compilation() as compiled:
            begin = time.perf_counter()
            cells, used = samples(table, max_angle, measure, effort.nodes)
            values = table.planes[:, used]
            bound = loss.bind(values)
            summary = in_threads(lambda t: summarise(t, used), [table])
            named = in_threads(lambda v: _named_losses(v, bound), [values])
            kept.clear()
            both = compress(cells, table, used, max_angle, measure, bound) if compressed else cells
            summarised, losses, largest = next(summary), next(named), largest_value(table)
            took = time.perf_counter() - begin - compiled.away
        kept[key] = Prepared(both, used, summarised, bound, losses, largest, took)
        return kept[key]


def _named_losses(values: NDArray[np.float64], own: Loss) -> tuple[Loss, ...]:
    """Every named loss, ready for these measured values, and one's own where it is not among them."""
    named = tuple(loss.bind(values) for loss in LOSSES.values())
    return named if own.name in LOSSES else (*named, own)


def at_hand(table: Table, max_angle: float, measure: str, loss: Loss | None) -> Prepared | None:
    """What is kept for a table and these settings, under a loss or, for None, under any."""
    every = list(_prepared.get(table, {}).items())  # a copy: another thread may prepare it meanwhile
    kept = (p for key, p in every if key[:2] == (max_angle, measure) and loss in (None, key[2]))
    return next(kept, None)


__all__ = ["Prepared", "at_hand", "prepare"]
