"""What an approximate part costs in accuracy and saves in time: Schlick for Fresnel, other maskings for Smith's."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..fitting import Effort, Fit, fit
from ..fitting.spike import is_spike, largest_value
from ..models import BRDF, parameter_values
from ..tables import Table
from ..tabulated import read, tabulate
from .evaluation import Evaluation, Operations, direct
from .exchange import COUNTERPART, FRESNELS, MASKINGS, PARTS, exchanged
from .sample import Sample
from .timing import Timing, interleaved

Reals = NDArray[np.float64]

REPEATS = 7
BUDGET = 3.0
NEARBY = Effort(path="compressed", starts=2)


@dataclass(frozen=True)
class Approximation:
    """One part of a fitted model in one form."""

    part: str
    """``"fresnel"`` or ``"masking"``."""
    model: str
    form: str
    own: bool
    """Whether it is the form that the model is defined with."""
    seconds: Timing
    """For one pair of directions and all channels, in float32; Smith's masking is read from a table made once."""
    operations: Operations
    """Of the same program."""
    typical: float
    """Median relative difference of the BRDF from the model's own form, with the same parameters."""
    large: float
    """99th percentile of it."""
    errors: dict[str, float]
    """On a sample of the cells, with the same parameters."""
    refitted: dict[str, float]
    """Over all cells, with the parameters fitted again; empty if that fit did not converge, or became a spike."""


def approximations(
    part: str, fits: Sequence[Fit], table: Table, sample: Sample, losses: Sequence[str]
) -> list[Approximation]:
    """Every form of one part, ``"fresnel"`` or ``"masking"``, in every fitted model that has it; a model's own first."""
    programs: dict[tuple[str, str], Evaluation] = {}
    values: dict[tuple[str, str], Reals] = {}
    refits: dict[tuple[str, str], Future[dict[str, float]]] = {}
    largest = largest_value(table)
    with ThreadPoolExecutor(os.cpu_count()) as pool:  # programs are compiled and run outside Python's lock
        for f in fits:
            for k, (form, m) in enumerate(_forms(part, f.model).items()):
                key = f.model_name, form
                refits[key] = pool.submit(_refitted, table, m, f, largest) if k else pool.submit(dict, f.errors)
                made = tabulate(m)
                how, what = (read, made) if made.tables else (direct, m)
                programs[key] = Evaluation(how, what, sample, "float32")
                values[key] = Evaluation(how, what, sample, "float64").values()
    seconds = interleaved(programs, REPEATS, BUDGET)
    out = []
    first: dict[str, str] = {}
    for name, form in programs:
        own = values[name, first.setdefault(name, form)]
        off = np.abs(values[name, form] - own) / np.maximum(np.abs(own), 1e-30)
        out.append(
            Approximation(
                part=part,
                model=name,
                form=form,
                own=first[name] == form,
                seconds=seconds[name, form].per(len(sample.wi)),
                operations=programs[name, form].operations(),
                typical=float(np.median(off)),
                large=float(np.percentile(off, 99)),
                errors={k: sample.error(values[name, form], k) for k in losses},
                refitted={k: v for k, v in refits[name, form].result().items() if k in losses},
            )
        )
    return out


def _forms(part: str, model: BRDF | None) -> dict[str, BRDF]:
    """The model with each form of the part, its own first; none if it does not have it."""
    cls = type(model)
    if model is None or cls not in PARTS or (part == "fresnel" and cls not in FRESNELS):
        return {}
    values = parameter_values(model)
    if part == "fresnel":
        return {form: exchanged(cls, fresnel=term)(**values) for form, term in FRESNELS[cls].items()}
    own = PARTS[cls].masking
    return {form: exchanged(cls, masking=MASKINGS[form].visibility)(**values) for form in (own, COUNTERPART[own], "none")}


def _refitted(table: Table, start: BRDF, like: Fit, largest: float) -> dict[str, float]:
    """Errors of a fit that starts at the old parameters: nearby optima are what an exchanged part is judged by."""
    again = fit(table, start, loss=like.loss, measure=like.measure, max_angle=like.max_angle, effort=NEARBY)
    useful = again.converged and again.model is not None and not is_spike(again.model, largest)
    return again.errors if useful else {}


__all__ = ["Approximation", "approximations"]
