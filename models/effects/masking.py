"""Masking and shadowing of facets by each other."""

from __future__ import annotations

from dataclasses import replace

from ..masking import smith_correlated
from ..parts import Parts
from .effect import Effect


def _add(parts: Parts, effects: frozenset[str]) -> Parts:
    return replace(parts, visibility=smith_correlated)


MASKING = Effect(
    "masking",
    "masking and shadowing, exact Smith of the lobe itself, height-correlated",
    "V = 1/(4 n.l n.v (1 + Lambda(l) + Lambda(v))) in place of 1/4",
    {},
    _add,
    needs=("lobe",),
    references=("smith1967", "heitz2014"),
)
