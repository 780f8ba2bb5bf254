"""How many nodes Smith's integral needs, at the fitted lobes.

Lambda(theta) is an integral over t in [0, pi/2] (:func:`brdfit.models.masking.smith_lambda`). The package's rule puts nodes
evenly in u, cos t = 1/cosh u; the rule that anyone would try first, Gauss-Legendre in t, stands beside it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..fitting import Fit
from ..geometry import Geometry
from ..models import BRDF, parameter_values
from ..models.masking.smith import NDF, NODES, REACH, Rule, smith_correlated, smith_separable
from ..quadrature import gauss_legendre, smith_kernel
from ..tabulated import read, tabulate
from .evaluation import Evaluation, direct
from .exchange import PARTS, Field, Masking, exchanged
from .sample import Sample
from .timing import Timing, interleaved

Reals = NDArray[np.float64]

COUNTS = (8, 16, 32, 64, 128, NODES)
PLAIN_COUNTS = (4, 8, 16, 32)
REFERENCE = 8 * NODES
"""Nodes of the reference: errs by the same 1e-9 at 89.995 degrees as 40-digit arithmetic shows of the package's own
(docs/stability.md), and by rounding below 80 degrees."""
FEW = 2048
"""Directions that are compared with the reference."""
REPEATS = 5
BUDGET = 6.0


@dataclass(frozen=True)
class Quadrature:
    """One rule for the integral, in one model."""

    model: str
    rule: str
    """``"even in u"`` (the package's), ``"Gauss-Legendre in t"`` or ``"table"``."""
    nodes: int
    seconds: Timing
    """For one pair of directions and all channels, in float64."""
    largest: float
    """Largest relative difference of the BRDF from the reference."""
    typical: float
    """Median of it."""
    errors: dict[str, float]
    """On a sample of the cells."""
    excess: dict[str, float]
    """Change of the error, relative, against the package's own rule on the same sample."""


def plain(nodes: int, reach: float = REACH) -> Rule:
    """Gauss-Legendre in t, in the form of :func:`brdfit.quadrature.smith_kernel`."""
    x, w = gauss_legendre(nodes)
    t = np.pi / 2 * x
    sine, cosine, width = np.sin(t), np.cos(t), np.pi / 2 * w
    return cosine**2, width * (sine - t * cosine) * sine, width * t * cosine * sine, width * cosine**2 / 2


RULES: dict[str, Callable[[int, float], Rule]] = {"even in u": smith_kernel, "Gauss-Legendre in t": plain}


@cache
def masking_by(rule: str, nodes: int, correlated: bool) -> Masking:
    """Smith masking with a rule of so many nodes."""

    def masking(lobe: NDF, g: Geometry) -> Field:
        reach = REACH if nodes == REFERENCE else getattr(lobe, "smith_reach", REACH)
        form = smith_correlated if correlated else smith_separable
        return form(lobe, g, RULES[rule](nodes, reach))

    return masking


def with_rule(model: BRDF, rule: str, nodes: int) -> BRDF:
    """A fitted model with its masking by a rule of so many nodes."""
    cls = type(model)
    masking = masking_by(rule, nodes, PARTS[cls].masking == "Smith, height-correlated")
    return exchanged(cls, masking=masking)(**parameter_values(model))


def quadratures(fits: Sequence[Fit], sample: Sample, losses: Sequence[str]) -> list[Quadrature]:
    """Every rule and number of nodes for every fitted model with Smith's integral."""
    few = Sample(sample.wi[:FEW], sample.wo[:FEW], sample.measured[:FEW], sample.max_angle)
    programs: dict[tuple[str, str, int], Evaluation] = {}
    reference: dict[str, Reals] = {}
    for fit in fits:
        m = fit.model
        if m is None or type(m) not in PARTS or not PARTS[type(m)].integral:
            continue
        reference[fit.model_name] = Evaluation(direct, with_rule(m, "even in u", REFERENCE), few, "float64").values()
        for rule, counts in (("even in u", COUNTS), ("Gauss-Legendre in t", PLAIN_COUNTS)):
            for n in counts:
                what: Any = with_rule(m, rule, n)
                programs[fit.model_name, rule, n] = Evaluation(direct, what, sample, "float64")
        table = tabulate(m)
        programs[fit.model_name, "table", NODES] = Evaluation(read, table, sample, "float64")
    seconds = interleaved(programs, REPEATS, BUDGET)
    values = {key: e.values() for key, e in programs.items()}
    own = {name: {k: sample.error(values[name, "even in u", NODES], k) for k in losses} for name in reference}
    out = []
    for (name, rule, n), got in values.items():
        off = np.abs(got[:FEW] / reference[name] - 1)
        errors = {k: sample.error(got, k) for k in losses}
        excess = {k: e / own[name][k] - 1 for k, e in errors.items()}
        took = seconds[name, rule, n].per(len(sample.wi))
        out.append(Quadrature(name, rule, n, took, float(off.max()), float(np.median(off)), errors, excess))
    return out


__all__ = ["Quadrature", "plain", "quadratures", "with_rule"]
