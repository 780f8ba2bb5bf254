"""All measurements on one material, in order, each followed by its sentence of advice."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from ..fitting import Fit, fit_many
from ..fitting.spike import is_spike, largest_value
from ..models import variants
from ..progress import Progress
from ..reports.words import SEEN, no_word
from ..tables import Table
from .advice import (
    fresnel_advice,
    masking_advice,
    quadrature_advice,
    rendering_advice,
    settings_advice,
    without_spikes,
)
from .approximations import Approximation, approximations
from .rendering import Rendering, renderings
from .sample import draw
from .settings import Setting, settings
from .smith import Quadrature, quadratures

MODELS = ("gtr", "abc", "sgd", "ward", "ashikhmin_shirley", "lambert")
"""What is compared in any case: the models that are fitted by default, and a body without a lobe. All there are would take
minutes."""

QUESTIONS = 5
"""What there is advice on."""

WHOLE = 70.0
"""Seconds that all measurements may take: the settings of a fit, which come last, get what is left of them."""
LEAST = 30.0
"""Seconds that the settings get in any case."""


def compared(model: str | None = None) -> tuple[str, ...]:
    """The models that are compared if ``model`` is asked about: :data:`MODELS`, and that one.

    Raises ValueError for an unknown name.
    """
    return MODELS if model is None else tuple(dict.fromkeys((*MODELS, variants(model)[0].name)))


def pieces(model: str | None = None) -> int:
    """Steps that :func:`tradeoff` reports to a progress."""
    return len(compared(model)) + QUESTIONS


@dataclass(frozen=True)
class Tradeoff:
    """What accuracy costs in time, for one material on this machine."""

    table: Table
    fits: tuple[Fit, ...]
    """Every model with default settings."""
    optimum: Fit | None
    """Of all cells, of the model whose settings were measured; None where no model could be fitted."""
    settings: list[Setting]
    renderings: list[Rendering]
    quadratures: list[Quadrature]
    fresnel: list[Approximation]
    masking: list[Approximation]
    advice: dict[str, str]
    """One sentence for each question: settings, rendering, quadrature, fresnel, masking."""


def tradeoff(
    table: Table,
    model: str | None = None,
    *,
    loss: str = "log",
    measure: str = "solid_angle",
    max_angle: float = 80.0,
    progress: Progress | None = None,
) -> Tradeoff:
    """Measure everything on one table.

    Args:
        table: What was measured.
        model: Whose fitting settings are measured; by default that of the smallest ``perceptual`` error. One that is not
            among :data:`MODELS` is compared with them.
        loss: What fits minimise.
        measure: What a cell counts by, ``"solid_angle"`` or ``"cells"``.
        max_angle: Largest polar angle of either direction, degrees, in (0, 90).
        progress: Where to say what was done, :func:`pieces` times.

    Raises:
        InputError: No cell lies within ``max_angle``.
        ValueError: Unknown model, loss or measure.
    """
    begin = time.perf_counter()
    names = compared(model)
    progress = progress or Progress(pieces(model), silent=True)
    sample = draw(table, max_angle, measure)
    fits: list[Fit] = []
    progress.say(f"{table.material}: fitting")
    for f in fit_many([table], list(names), loss=loss, measure=measure, max_angle=max_angle):
        fits.append(f)
        took = f"{f.seconds['prepare'] + f.seconds['solve']:.2f} s"
        progress.advance(f"{f.model_name}: perceptual {f.errors['perceptual']:.5f}, {took}" if f.model else f.reason)
    fits.sort(key=lambda f: names.index(f.model_name))
    losses = tuple(dict.fromkeys(("perceptual", loss)))
    largest = largest_value(table)
    spikes = [f.model_name for f in fits if f.model is not None and is_spike(f.model, largest)]
    advice: dict[str, str] = {}

    def advised(question: str, sentence: str) -> None:
        advice[question] = without_spikes(sentence, spikes)
        progress.advance(f"{question}: {advice[question]}")

    progress.say("rendering")
    drawn = renderings(fits, sample)
    cosines = sample.wi[:, 2] * sample.wo[:, 2]
    reflectance = np.pi * float((sample.measured.mean(1) * cosines).sum() / cosines.sum())
    seen = 0.0 if no_word(measure, reflectance) else SEEN
    advised("rendering", rendering_advice([r for r in drawn if r.model not in spikes], seen))
    progress.say("Smith's integral")
    rules = quadratures(fits, sample, losses)
    advised("quadrature", quadrature_advice([r for r in rules if r.model not in spikes]))
    progress.say("Fresnel")
    fresnel = approximations("fresnel", fits, table, sample, losses)
    advised("fresnel", fresnel_advice([a for a in fresnel if a.model not in spikes]))
    progress.say("masking")
    masking = approximations("masking", fits, table, sample, losses)
    advised("masking", masking_advice([a for a in masking if a.model not in spikes]))
    progress.say("settings of a fit")
    asked = names if model is None else (variants(model)[0].name,)
    usable = [f for f in fits if f.model is not None and f.model_name in asked]
    optimum, measured = None, list[Setting]()
    if usable:
        best = min(usable, key=lambda f: (f.model_name in spikes, f.errors["perceptual"]))
        optimum, measured = settings(table, best, max(LEAST, WHOLE - (time.perf_counter() - begin)))
    advised("settings", settings_advice(measured, optimum))
    return Tradeoff(table, tuple(fits), optimum, measured, drawn, rules, fresnel, masking, advice)


__all__ = ["Tradeoff", "compared", "pieces", "tradeoff"]
