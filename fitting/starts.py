"""Where a fit starts: shapes of the lobe read off the data, and everything else a linear refit away.

The lobe's half-width t is where P(theta_h), the mean of the table at theta_d between 1 and 30 degrees, has fallen half way
from its value at the pole to its smallest. Each model turns t into a handful of shapes; the colours follow from a refit of
the linear coordinates alone, and the best shapes are polished together with the colours.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ..angles import half_difference
from ..models import BRDF, parameters_of
from ..models.abc import ABC
from ..models.ashikhmin_shirley import AshikhminShirley, AshikhminShirleyAnisotropic
from ..models.gtr import GTR
from ..models.sgd import SGD
from ..models.ward import Ward, WardAnisotropic
from ..tables import HalfDifferenceGrid, Table

Shape = dict[str, float]


@dataclass(frozen=True)
class Summary:
    """What starts are made of."""

    half_width: float
    """Half-width t of the lobe, radians, within [1e-3, 1.2]."""
    body: NDArray[np.float64]
    """Albedo ``[C]`` of the body term: pi times the lower quartile of the table at theta_d below 45 degrees."""


def summarise(table: Table, used: NDArray[np.bool_]) -> Summary:
    """Half-width and body of the fitted cells of a table."""
    if isinstance(table.layout, HalfDifferenceGrid) and table.isotropic:
        # whole rows of the grid: no list of a million directions is made
        d = np.flatnonzero(table.layout.theta_d < np.radians(45))
        rows = used[:, d]
        values = table.planes[:, :, d]
        theta_d = np.broadcast_to(table.layout.theta_d[d][None, :, None], rows.shape)[rows]
        row = np.broadcast_to(np.arange(rows.shape[0])[:, None, None], rows.shape)[rows]
        angle = table.layout.theta_h
        values = values[:, rows]
    else:
        wi, wo = (v[used] for v in table.layout.directions())
        theta_h, theta_d, _, _ = half_difference(wi, wo)
        near = theta_d < np.radians(45)
        edges = (np.arange(61) / 60) ** 2 * (np.pi / 2)
        row = np.searchsorted(edges, theta_h[near], side="right") - 1
        angle = (edges[:-1] + edges[1:]) / 2
        theta_d, values = theta_d[near], table.planes[:, used][:, near]
    if not values.size:
        return Summary(0.3, np.full(table.channels, 0.1))
    body = np.pi * np.quantile(values, 0.25, axis=1)
    lobe = (theta_d >= np.radians(1)) & (theta_d <= np.radians(30))
    count = np.bincount(row[lobe], minlength=len(angle))
    total = np.bincount(row[lobe], values[:, lobe].mean(0), minlength=len(angle))
    seen = np.flatnonzero(count)
    if not len(seen):
        return Summary(0.3, body)
    profile = total[seen] / count[seen]
    below = np.flatnonzero(profile < (profile[0] + profile.min()) / 2)
    t = float(angle[seen[below[0]]]) if len(below) else 1.2
    return Summary(float(np.clip(t, 1e-3, 1.2)), body)


def _gtr(t: float) -> Iterator[Shape]:
    s2 = np.sin(t) ** 2
    for gamma, scale in product((1.1, 2.0, 4.0), (0.3, 1.0, 3.0)):
        kappa = np.expm1(np.log(2) / gamma) / (s2 * scale**2)
        yield {"alpha": (1 + kappa) ** -0.5, "gamma": gamma}
    # the pure power law, its gentler neighbours, the Gaussian limit, and lobes that grow towards grazing
    yield from ({"alpha": a, "gamma": g} for a, g in ((1e-6, 1.03), (1e-6, 1.15), (1e-4, 1.15), (3e-3, 1.4)))
    for scale in (0.5, 1.0, 2.0):
        gamma = 300.0
        yield {"alpha": float(np.exp(-np.log(2) / (s2 * scale**2) / gamma / 2)), "gamma": gamma}
    yield from ({"alpha": a, "gamma": g} for a, g in ((1.3, 2.0), (2.0, 1.0), (1.05, 20.0)))


def _abc(t: float) -> Iterator[Shape]:
    for c, ior, scale in product((0.4, 0.7, 1.0, 1.6, 4.0), (1.3, 1.7, 6.0, 60.0), (1.0, 0.2)):
        b = np.expm1(np.log(2) / c) / ((1 - np.cos(t)) * scale)
        yield {"b": float(b), "c": c, "ior": ior}
    yield from ({"b": 1 / (1 - np.cos(t)), "c": 20.0, "ior": ior} for ior in (1.5, 60.0))


def _sgd(t: float) -> Iterator[Shape]:
    tan2 = np.tan(t) ** 2
    for p, scale in product((-1.0, 0.0, 0.5, 1.0, 1.5, 3.0), (0.1, 1.0, 4.0)):
        grid = np.exp(np.linspace(np.log(1e-7), np.log(30), 2000))
        fall = tan2 * scale / grid + p * np.log1p(tan2 * scale / grid**2)
        yield {"alpha": float(grid[np.argmin(np.abs(fall - np.log(2)))]), "p": p}
    yield from ({"alpha": a, "p": p} for a, p in ((1e-4, 1.2), (1e-3, 1.0), (0.3, 8.0), (2.0, 20.0)))


def _ward(t: float) -> Iterator[Shape]:
    for scale in (0.3, 0.6, 1.0, 2.0, 5.0, 15.0):
        yield {"alpha": float(np.clip(np.tan(t) / np.sqrt(np.log(2)) * scale, 2e-4, 20))}


def _ashikhmin_shirley(t: float) -> Iterator[Shape]:
    exponent = -np.log(2) / np.log(np.cos(t))
    for scale in (0.1, 0.3, 1.0, 3.0, 10.0):
        yield {"exponent": float(np.clip(exponent * scale, 2e-3, 5e6))}
    yield from ({"exponent": e} for e in (0.05, 1.0, 5.0))


def _pairs(shapes: Callable[[float], Iterator[Shape]], name: str) -> Callable[[float], Iterator[Shape]]:
    """Elliptical shapes from round ones: each stretched either way."""

    def pairs(t: float) -> Iterator[Shape]:
        for shape, stretch in product(shapes(t), (0.4, 1.0, 2.5)):
            yield {f"{name}_x": shape[name] * stretch, f"{name}_y": shape[name] / stretch}

    return pairs


_SHAPES: dict[type[BRDF], Callable[[float], Iterator[Shape]]] = {
    GTR: _gtr,
    ABC: _abc,
    SGD: _sgd,
    Ward: _ward,
    WardAnisotropic: _pairs(_ward, "alpha"),
    AshikhminShirley: _ashikhmin_shirley,
    AshikhminShirleyAnisotropic: _pairs(_ashikhmin_shirley, "exponent"),
}

GENERIC = 24
"""Starts of a model that has no shapes of its own: its defaults and points spread over its search box."""


def _generic(cls: type[BRDF], seed: int) -> Iterator[Shape]:
    """Defaults, then a random Latin hypercube over the boxes (logarithmic where the parameter is)."""
    shapes = [p for p in parameters_of(cls) if not p.linear]
    yield {}
    rng = np.random.default_rng(seed)
    strata = np.stack([rng.permutation(GENERIC - 1) for _ in shapes], -1) if shapes else np.zeros((0, 0))
    for row in (strata + rng.random(strata.shape)) / (GENERIC - 1):
        shape = {}
        for p, u in zip(shapes, row, strict=True):
            lower, upper = p.search
            if p.log and np.isfinite(upper):
                shape[p.name] = float(np.exp(np.log(lower) + u * np.log(upper / lower)))
            elif np.isfinite(lower) and np.isfinite(upper):
                shape[p.name] = float(lower + u * (upper - lower))
            else:
                shape[p.name] = p.default * float(np.exp(4 * u - 2))
        yield shape


def starts(cls: type[BRDF], summary: Summary, seed: int) -> Iterator[dict[str, NDArray[np.float64]]]:
    """Full parameter sets to start from, arrays ``[]`` or ``[C]``."""
    shapes = _SHAPES[cls](summary.half_width) if cls in _SHAPES else _generic(cls, seed)
    channels = len(summary.body)
    for shape in shapes:
        values = {}
        for p in parameters_of(cls):
            value: NDArray[np.float64] = np.asarray(shape.get(p.name, p.default), float)
            if p.name == "diffuse":
                value = summary.body
            values[p.name] = np.broadcast_to(value, (channels,)).copy() if p.per_channel else value
        yield values
