"""Where a fit starts: shapes of the lobe read off the data, and everything else a linear refit away.

The lobe's half-width t is where P(theta_h), the mean of the table at theta_d between 1 and 30 degrees, has fallen half way
from its value at the pole to its smallest. Each model turns t into a handful of shapes; the colours follow from a refit of
the linear coordinates alone, and the best shapes are polished together with the colours.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..angles import half_difference
from ..models import BRDF, parameters_of
from ..tables import HalfDifferenceGrid, Table

Shape = dict[str, float]


@dataclass(frozen=True)
class Summary:
    """What starts are made of."""

    half_width: float
    """Half-width t of the lobe, radians, within [1e-3, 1.2]."""
    body: NDArray[np.float64]
    """Albedo ``[C]`` of the body term: pi times the lower quartile of the table at theta_d below 45 degrees."""


ALONG_PHI = 45
"""Cells of a row along phi_d that a summary looks at."""


def summarise(table: Table, used: NDArray[np.bool_]) -> Summary:
    """Half-width and body of the fitted cells of a table."""
    if isinstance(table.layout, HalfDifferenceGrid) and table.isotropic:
        # whole rows of the grid: no list of a million directions is made
        d = np.flatnonzero(table.layout.theta_d < np.radians(45))
        along = slice(None, None, max(1, len(table.layout.phi_d) // ALONG_PHI))
        rows = used[:, d, along]
        values = table.planes[:, :, d, along]
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
    shapes = cls.shapes(summary.half_width)
    channels = len(summary.body)
    for shape in _generic(cls, seed) if shapes is None else shapes:
        values = {}
        for p in parameters_of(cls):
            value: NDArray[np.float64] = np.asarray(shape.get(p.name, p.default), float)
            if p.name == "diffuse":
                value = summary.body
            values[p.name] = np.broadcast_to(value, (channels,)).copy() if p.per_channel else value
        yield values
