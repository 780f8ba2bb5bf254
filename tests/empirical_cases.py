"""Cases of the empirical and wave-optical models: twelve parameter sets each, and the directions they are tested at."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from brdfit import models
from brdfit.models import BRDF, parameters_of
from numpy.typing import NDArray

from .cases import WI, WO

Reals = NDArray[np.float64]
Case = Mapping[str, float]

PARAMETER_SETS = 12

AWAY = np.abs(2 * WI[:, 2] * WO[:, 2] - (WI * WO).sum(-1)) > 1e-12
"""Not the pair whose r.v is 0 but for rounding: there a lobe about r ends."""
WI, WO = WI[AWAY], WO[AWAY]

SLOPES = np.array([0, 3, 12, 14, 20, 27, 33, 36, -4, -2])
"""Directions whose derivatives have an oracle, five for each case in turn."""


@dataclass(frozen=True)
class Row:
    """One class: one channel's parameters a case, and what its docstring claims."""

    model: type[BRDF]
    cases: tuple[Case, ...]
    reciprocal: bool = True
    kink: Any = None
    """Mask ``[n]`` of directions without derivative."""
    faint: Any = None
    """Mask ``[n]`` of directions where a cosine that a lobe is a power of is so small that float32 does not hold it."""
    energy: tuple[Case, ...] = ()
    """Cases whose albedo must not exceed 1."""
    truth: Case = field(default_factory=dict)
    """Shape of a synthetic material that is fitted."""

    @property
    def name(self) -> str:
        return self.model.__name__

    def stacked(self, dtype: Any = np.float64, cases: tuple[Case, ...] = ()) -> BRDF:
        """Cases as one instance with a leading axis of cases, and one channel."""
        specs = parameters_of(self.model)
        columns = {p.name: np.array([c[p.name] for c in cases or self.cases], dtype) for p in specs}
        return self.model(**{p.name: columns[p.name][:, None] if p.per_channel else columns[p.name] for p in specs})


def row(name: str, base: Case, *changes: Case, **options: Any) -> Row:
    """``base`` and its changes, filled up with random draws from the search boxes."""
    model = models.MODELS[name][0]
    cases = [{**base, **c} for c in ({}, *changes)]
    rng = np.random.default_rng(11)
    while len(cases) < PARAMETER_SETS:
        case = {}
        for p in parameters_of(model):
            low, high = p.search
            low, high = (low if np.isfinite(low) else -1.0), (high if np.isfinite(high) else 2.0)
            case[p.name] = float(np.exp(rng.uniform(*np.log([low, high])))) if p.log else float(rng.uniform(low, high))
        cases.append(case)
    energy = tuple({**base, **c} for c in options.pop("energy", ()))
    return Row(model, tuple(cases[:PARAMETER_SETS]), energy=energy, **options)


LOBE = {"diffuse": 0.1, "specular": 0.2, "exponent": 50.0}
EXPONENTS = [{"exponent": e} for e in (1.0, 3.0, 1e3, 1e7)] + [{"diffuse": 0.0, "exponent": 300.0}]
FULL = [{"diffuse": 0.0, "specular": 1.0, "exponent": e} for e in (0.0, 1.0, 4.0, 60.0)]
LEVEL = np.abs(WI[:, 2] - WO[:, 2]) < 1e-6
ENDING = np.abs(2 * WI[:, 2] * WO[:, 2] - (WI * WO).sum(-1)) < 0.01
"""Where r.v is nearly 0."""
CREASE = LEVEL | (np.abs((WI * WO)[:, :2].sum(-1)) < 1e-9)
"""Where in addition l and v lie at right angles about the normal, or along it."""
ROUGH = {"diffuse": 0.5, "sigma": 0.4}
ROUGHER = [{"sigma": s} for s in (0.0, 1e-2, 1.0, 3.0)] + [{"diffuse": 0.0}, {"diffuse": 1.0}]

EMPIRICAL: tuple[Row, ...] = (
    row("phong", LOBE, *EXPONENTS, reciprocal=False, faint=ENDING, truth={"exponent": 40.0}),
    row("modified_phong", LOBE, *EXPONENTS, energy=FULL, faint=ENDING, truth={"exponent": 40.0}),
    row("max_phong", LOBE, *EXPONENTS, kink=LEVEL, energy=FULL, faint=ENDING, truth={"exponent": 40.0}),
    row("blinn_phong", LOBE, *EXPONENTS, {"exponent": 0.0}, truth={"exponent": 80.0}),
    row("modified_blinn_phong", LOBE, *EXPONENTS, {"exponent": 0.0}, energy=FULL, truth={"exponent": 80.0}),
    row("oren_nayar", ROUGH, *ROUGHER, kink=CREASE, energy=[{"diffuse": 0.984, "sigma": s} for s in (0.1, 0.2, 0.5, 3.0)]),
    row("oren_nayar_full", ROUGH, *ROUGHER, kink=CREASE),
)
