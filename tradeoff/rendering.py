"""What a more expressive model buys and what it costs to render with."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Array

from ..fitting import Fit
from ..tabulated import read, tabulate
from .evaluation import Evaluation, Operations, direct
from .sample import Sample
from .timing import Timing, interleaved

REPEATS = 9
BUDGET = 8.0


@dataclass(frozen=True)
class Rendering:
    """One way to evaluate a fitted model."""

    label: str
    model: str
    masking: str
    """``"integral"``: Smith's integral for each pair of directions; ``"table"``: read off a table; ``""``: closed form."""
    numbers: int
    """Fitted numbers."""
    seconds: Timing
    """For one pair of directions and all channels, in float32."""
    seconds_float64: Timing
    operations: Operations
    errors: dict[str, float]
    """Of the fit, over all its cells, by loss."""
    deviation: float
    """Largest relative difference from the model evaluated directly in float64."""


def renderings(fits: Sequence[Fit], sample: Sample) -> list[Rendering]:
    """Every fitted model, and those with Smith's integral once more with masking from a table."""
    narrow: dict[tuple[str, str], Evaluation] = {}
    wide: dict[tuple[str, str], Evaluation] = {}
    of = {f.model_name: f for f in fits if f.model is not None}
    for name, fit in of.items():
        assert fit.model is not None
        made = tabulate(fit.model)
        integral = bool(made.tables)
        ways: list[tuple[str, Callable[[Any, Array, Array], Array], Any]] = [
            ("integral" if integral else "", direct, fit.model)
        ]
        if integral:
            ways.append(("table", read, made))
        for masking, function, what in ways:
            for dtype, programs in (("float32", narrow), ("float64", wide)):
                programs[name, masking] = Evaluation(function, what, sample, dtype)
    both = {("float32", *k): e for k, e in narrow.items()} | {("float64", *k): e for k, e in wide.items()}
    seconds = interleaved(both, REPEATS, BUDGET)
    out = []
    for name, masking in narrow:
        fit = of[name]
        exact = wide[name, "integral" if masking else ""].values()
        given = narrow[name, masking].values()
        out.append(
            Rendering(
                label=f"{name}, table" if masking == "table" else name,
                model=name,
                masking=masking,
                numbers=sum(v.size for v in fit.parameters.values()),
                seconds=seconds["float32", name, masking].per(len(sample.wi)),
                seconds_float64=seconds["float64", name, masking].per(len(sample.wi)),
                operations=narrow[name, masking].operations(),
                errors=dict(fit.errors),
                deviation=float(np.max(np.abs(given - exact) / np.maximum(np.abs(exact), 1e-30))),
            )
        )
    return out


__all__ = ["Rendering", "renderings"]
