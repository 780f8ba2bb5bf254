"""What an effect is: parameters, and what it does to the parts of a model."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..base import Parameter
from ..parts import Parts, Switch

Declared = dict[str, Parameter]
Shapes = list[dict[str, float]]
Present = Mapping[str, Switch | None]
"""The effects of a model, each with its switch; None where it is simply there, as in every model that has a name."""
Values = dict[str, NDArray[np.float64]]
"""Parameters by name, ``[]`` or ``[C]``."""
Neutral = Callable[[Values, frozenset[str]], Values | None]


def _nothing_else(parameters: Declared) -> Declared:
    return parameters


def _from_defaults(half_width: float, shapes: Shapes) -> Shapes:
    return shapes


def replaces(values: Values, others: frozenset[str]) -> Values | None:
    """Of an effect that puts another term in place of one: no value of its parameters takes that back."""
    return None


def at(**given: float) -> Neutral:
    """Parameters that the effect adds, at these values."""

    def neutral(values: Values, others: frozenset[str]) -> Values | None:
        return values | {name: np.asarray(value) for name, value in given.items()}

    return neutral


def crossed(shapes: Shapes, options: Shapes) -> Shapes:
    """Every shape with some of the options, twice as many in all: the crossing of several effects would be too many."""
    n = len(options)
    return [s | options[(2 * k + r) % n] for k, s in enumerate(shapes) for r in range(2)]


@dataclass(frozen=True)
class Effect:
    """One effect of reflection, as a change to the parts of a model that lacks it."""

    name: str
    meaning: str
    """What it is, in a few words."""
    formula: str
    """What it adds or replaces, in the notation of the documentation."""
    parameters: Mapping[str, Any]
    """What it adds to the parameters of a model, as :func:`brdfit.parameter` declares it."""
    add: Callable[[Parts, Present], Parts]
    """The parts with it, of the parts without it and all effects of the model."""
    neutral: Neutral
    """Of the parameters of a model without it, and of the effects of that, parameters with it that make the same model;
    what is left out does not matter. None if there are none: a fit may then be worse for the effect.
    """
    needs: tuple[str, ...] = ()
    """Effects it makes no sense without: of each entry, as ``"lobe"`` or ``"lobe or diffraction"``, one."""
    declare: Callable[[Declared], Declared] = _nothing_else
    """What it changes about the parameters, its own and those of the effects before it."""
    start: Callable[[float, Shapes], Shapes] = _from_defaults
    """Shapes that fits start from, of the half-width of the measured lobe and the shapes without the effect."""
    references: tuple[str, ...] = ()


__all__ = ["Declared", "Effect", "Neutral", "Present", "Shapes", "Values", "at", "crossed", "replaces"]
