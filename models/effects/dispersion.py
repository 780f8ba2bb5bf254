"""A lobe whose shape differs from channel to channel."""

from __future__ import annotations

from dataclasses import replace

from ..parts import Parts
from .effect import Declared, Effect, Present, Values

SHAPE = ("alpha", "alpha_x", "alpha_y", "gamma")


def _add(parts: Parts, effects: Present) -> Parts:
    return parts


def _declare(parameters: Declared) -> Declared:
    return {n: replace(p, per_channel=True) if n in SHAPE else p for n, p in parameters.items()}


def _neutral(values: Values, others: frozenset[str]) -> Values:
    """The same for all channels."""
    return values


DISPERSION = Effect(
    "dispersion",
    "a lobe shape for each channel",
    "alpha (or alpha_x, alpha_y) and gamma per channel in place of one for all",
    {},
    _add,
    neutral=_neutral,
    needs=("lobe",),
    declare=_declare,
    references=("bagher2012",),
)
