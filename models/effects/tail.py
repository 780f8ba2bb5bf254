"""A lobe with a second parameter: how fast it falls off."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from .. import ndf
from ..base import POSITIVE, parameter
from ..parts import Parts
from .effect import Effect, Present, Shapes, at
from .lobe import width


def _facets(m: Any) -> ndf.GTR:
    return ndf.GTR(width(m), m.gamma)


def _add(parts: Parts, effects: Present) -> Parts:
    first, *others = parts.lobes
    return replace(parts, lobes=(replace(first, facets=_facets), *others))


def _start(half_width: float, shapes: Shapes) -> Shapes:
    """Its own widths: tails change them."""
    others = [{k: v for k, v in s.items() if k != "alpha"} for s in shapes]
    return [others[k % len(others)] | t for k, t in enumerate(ndf.GTR.shapes(half_width))]


TAIL = Effect(
    "tail",
    "the fall-off of the lobe, with GTR in place of GGX",
    "D = k/(sin^2 theta_h + alpha^2 cos^2 theta_h)^gamma",
    {"gamma": parameter("fall-off of the tail (2: GGX, 1: Berry)", valid=POSITIVE, search=(0.01, 1e7), default=2, log=True)},
    _add,
    neutral=at(gamma=2),
    needs=("lobe",),
    start=_start,
    references=("burley2012", "hoffman2013"),
)
