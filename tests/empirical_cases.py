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
"""Directions whose derivatives have an oracle, five for each case in turn, or two where the oracle is a series."""


@dataclass(frozen=True)
class Row:
    """One class: one channel's parameters a case, and what its docstring claims."""

    model: type[BRDF]
    cases: tuple[Case, ...]
    reciprocal: bool = True
    kink: Any = None
    """Mask ``[n]`` of directions without derivative."""
    series: bool = False
    """Whether the oracle is a series, and slow."""
    tolerance: float = 1e-11
    """Relative error of the value."""
    energy: tuple[Case, ...] = ()
    """Cases whose albedo must not exceed 1."""
    grid: tuple[int, int, int] = (16, 12, 10)
    """Of the table that is fitted, theta_h, theta_d, phi_d."""
    truth: Case | None = field(default_factory=dict)
    """Shape of a synthetic material that is fitted; None where another row fits the same lobe, and to compile costs 3 s."""
    single: bool = True
    """Whether it is tested in float32: not if it is made of blocks alone that other rows are made of, and tested."""

    @property
    def name(self) -> str:
        return self.model.__name__

    def stacked(self, dtype: Any = np.float64, cases: tuple[Case, ...] = ()) -> BRDF:
        """Cases as one instance with a leading axis of cases, and one channel."""
        specs = parameters_of(self.model)
        columns = {p.name: np.array([c[p.name] for c in cases or self.cases], dtype) for p in specs}
        return self.model(**{p.name: columns[p.name][:, None] if p.per_channel else columns[p.name] for p in specs})


def row(name: str, base: Case, *changes: Case, form: int = 0, **options: Any) -> Row:
    """``base`` and its changes, filled up with random draws from the search boxes."""
    model = models.MODELS[name][form]
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
NORMAL = np.maximum(WI[:, 2], WO[:, 2]) > 1 - 1e-9
"""Where a polar angle has no derivative."""
CREASE = LEVEL | (np.abs((WI * WO)[:, :2].sum(-1)) < 1e-9)
"""Where in addition l and v lie at right angles about the normal, or along it."""
ROUGH = {"diffuse": 0.5, "sigma": 0.4}
ROUGHER = [{"sigma": s} for s in (0.0, 1e-2, 1.0, 3.0)] + [{"diffuse": 0.0}, {"diffuse": 1.0}]
TILTED = {"diffuse": 0.1, "specular": 0.2, "tilt": 0.75, "exponent": 50.0}
TILTS = [{"tilt": t} for t in (0.0, -0.7, -0.9, 0.9, 1.5, np.pi / 2, -np.pi / 2)]
TWO = {
    "diffuse": 0.1,
    "specular_1": 0.2,
    "specular_2": 0.1,
    "tilt_1": 0.82,
    "tilt_2": -0.7,
    "exponent_1": 90.0,
    "exponent_2": 5.0,
}
THREE = {**TWO, "specular_3": 0.05, "tilt_3": 0.6, "exponent_3": 9.0}
TILTS_1 = [{"tilt_1": t, "exponent_1": e} for t in (0.0, -0.8, 1.0) for e in (3.0, 1e4)]
LAYERS = {"specular": 0.04, "base": 0.3, "roughness": 0.02, "base_roughness": 0.8}
PLASTIC = {"diffuse": 0.4, "smoothness": 0.6, "metalness": 0.3, "transparency": 0.1}
SMOOTH = [{"smoothness": s} for s in (0.0, 0.9, 0.999)] + [{"metalness": 1.0, "transparency": 0.0}, {"transparency": 0.9}]
GLOSSY = {"diffuse": 0.1, "specular": 0.5, "smoothness": 0.7, "scale": 1.0}
TABULATED = {p.name: p.default for p in parameters_of(models.MODELS["distribution_based"][0])} | {"diffuse": 0.1}
WAVES = {"diffuse": 0.1, "specular": 0.5, "ior": 1.5, "sigma": 0.15, "tau": 1.5}
SURFACES = [
    (1e-3, 0.05),
    (1e-3, 200.0),
    (0.05, 3.0),
    (0.3, 1.0),
    (0.6, 0.8),
    (0.6, 20.0),
    (0.62, 2.0),
    (1.2, 9.0),
    (2.5, 60.0),
]
LAYERED = {"diffuse": 0.1, "specular": 0.3, "ior": 1.5, "thickness": 0.2, "exponent": 50.0, "base_exponent": 20.0}
FILMS = [{"thickness": 0.0}, {"thickness": 3.0}, {"ior": 1.001}, {"ior": 4.0}, {"exponent": 1e6}, {"base_exponent": 1e6}]

EMPIRICAL: tuple[Row, ...] = (
    row("phong", LOBE, *EXPONENTS, reciprocal=False, truth={"exponent": 40.0}),
    row("modified_phong", LOBE, *EXPONENTS, energy=FULL, truth=None),
    row("max_phong", LOBE, *EXPONENTS, kink=LEVEL, energy=FULL, truth=None),
    row("blinn_phong", LOBE, *EXPONENTS, {"exponent": 0.0}, truth={"exponent": 80.0}),
    row("modified_blinn_phong", LOBE, *EXPONENTS, {"exponent": 0.0}, energy=FULL, truth=None),
    row(
        "oren_nayar",
        ROUGH,
        *ROUGHER,
        kink=CREASE,
        truth=None,
        energy=[{"diffuse": 0.984, "sigma": s} for s in (0.1, 0.2, 0.5, 3.0)],
    ),
    row("oren_nayar_full", ROUGH, *ROUGHER, kink=CREASE),
    row("lafortune", TILTED, *TILTS, *EXPONENTS[1:], truth=None),
    row("lafortune2", TWO, *TILTS_1, truth=None),
    row("lafortune3", THREE, *TILTS_1, truth=THREE),
    row(
        "schlick",
        {"specular": 0.3, "roughness": 0.1},
        *({"roughness": r} for r in (1.0, 1e-9, 1e-4)),
        {"specular": 1e-3},
        truth=None,
    ),
    row("schlick_two_layers", LAYERS, {"roughness": 1e-9}, {"base_roughness": 1.0, "specular": 0.0}, {"specular": 1.0}),
    row("strauss", PLASTIC, *SMOOTH, reciprocal=False, kink=NORMAL, tolerance=1e-9),  # angles of 1e-8 are lost in the cosine
    row("schwenk", GLOSSY, {"smoothness": 0.0}, {"smoothness": 1.0, "diffuse": 0.0}, {"specular": 0.0}, {"scale": 0.0}),
    row("distribution_based", TABULATED, {"f0": 1.0}, {"p_3": -20.0}, {"p_1": 3.0, "p_2": 3.0}, grid=(48, 8, 6)),
    row("granier_heidrich", LAYERED, *FILMS, truth={"ior": [1.5, 1.7], "thickness": [0.2, 0.3]}),
    row(
        "htsg",
        WAVES,
        *({"sigma": s, "tau": t} for s, t in SURFACES),
        {"ior": 1.0},
        {"ior": 20.0},
        series=True,
        grid=(9, 7, 6),
    ),
    row("stam_diffraction", WAVES, *({"sigma": s, "tau": t} for s, t in SURFACES), {"ior": 20.0}, series=True, truth=None),
)
