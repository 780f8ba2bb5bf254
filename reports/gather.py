"""From a table and its fits to what the plots of a report need.

Every model is evaluated once, on one list of directions (lobes, sphere, albedo and a sample of the cells), because each
shape of an argument costs a compilation that takes longer than the evaluation.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..angles import directions, half_difference
from ..colours import channel_names, delta_e, exposure_of, screen
from ..physics import ANGLES, albedo_directions, albedo_of_values
from ..tables import HalfDifferenceGrid, SphericalGrid, Table
from ..values import values_of
from .evidence import Albedo, Evidence, Lobes, Maps, Sphere
from .published_fits import published

if TYPE_CHECKING:
    from ..fitting.result import Fit

Reals = NDArray[np.float64]

INCIDENCE = (10.0, 30.0, 50.0, 70.0)
"""Angles of incidence of the lobes, degrees."""

PIXELS = 144
"""Width and height of a rendered sphere."""

LIGHT = np.array([-0.45, 0.55, 0.704])
"""Direction to the light of the sphere: from the upper left, 45 degrees from the viewer."""


def fit_key(fit: Fit) -> str:
    """What tells fits of one material apart: model, loss, measure, angle convention and a digest of the parameters.

    The digest keeps evidence of an earlier fit from being shown for a later one.
    """
    digest = hashlib.sha256()
    for name, value in sorted(fit.parameters.items()):
        digest.update(name.encode() + np.ascontiguousarray(value, "<f8").tobytes())
    return f"{fit.model_name}/{fit.loss}/{fit.measure}/{fit.angles}/{digest.hexdigest()[:12]}"


class Views:
    """The directions in which a report shows a table, and what fits have there.

    Call it with a fit as soon as there is one, while others are being made; :meth:`evidence` then finds it done.
    """

    def __init__(self, table: Table, max_angle: float = 80.0) -> None:
        self.table = table
        self._missing: dict[str, str] = {}
        self._lobe_at = _lobe_directions(table, self._missing)
        self._sphere_at = sphere_directions()
        self._albedo_at = albedo_directions()
        self._cells_at = _cells(table, max_angle)
        lobes = self._lobe_at[1:3] if self._lobe_at else (np.zeros((0, 3)),) * 2
        pieces = [lobes, self._sphere_at[1:3], self._albedo_at[:2], self._cells_at[:2]]
        self._ends = np.cumsum([len(p[0]) for p in pieces])
        self._wi, self._wo = (np.concatenate([p[k] for p in pieces]) for k in (0, 1))
        self._values: dict[str, Reals] = {}

    def __call__(self, fit: Fit) -> Reals:
        """Values ``[n, C]`` of a fit in all directions, NaN without a model."""
        key = fit_key(fit)
        if key not in self._values:
            self._values[key] = values_of(fit.model, self._wi, self._wo, self.table.channels)
        return self._values[key]

    def evidence(self, fits: Sequence[Fit]) -> Evidence:
        """What the plots need of the table and these fits (those without a model keep their place, as NaN)."""
        table, missing = self.table, dict(self._missing)
        values = np.stack([self(f) for f in fits]) if fits else np.zeros((0, len(self._wi), table.channels))
        at_lobes, at_sphere, at_albedo, at_cells = np.split(values, self._ends[:-1], axis=1)
        lobes = None
        if self._lobe_at:
            angles, _, _, measured, how = self._lobe_at
            shape = (len(angles[0]), -1, table.channels)
            fitted = at_lobes.reshape(len(fits), *angles[1].shape, table.channels)
            lobes = Lobes(angles[0], angles[1], measured.reshape(shape), fitted, how)
        return Evidence(
            material=table.material,
            source=table.source,
            sha256=table.sha256,
            keys=tuple(fit_key(f) for f in fits),
            channel_names=channel_names(table),
            lobes=lobes,
            maps=_maps(at_cells, self._cells_at),
            sphere=sphere(table, self._sphere_at, at_sphere, missing),
            albedo=_albedo(table, self._albedo_at, at_albedo),
            published={fit_key(f): p for f, p in zip(fits, published(table, fits), strict=True) if p},
            missing=missing,
        )


def gather(table: Table, fits: Sequence[Fit]) -> Evidence:
    """What the plots need of one table and its fits."""
    return Views(table, min((f.max_angle for f in fits), default=80.0)).evidence(fits)


def interpolate(table: Table, wi: Reals, wo: Reals) -> Reals:
    """Values ``[n, C]`` of a table on a half/difference grid at unit vectors ``[n, 3]``, NaN where they are not known.

    Multilinear in (sqrt(theta_h), theta_d, phi_d) and, on anisotropic tables, phi_h. A value is known where every cell
    that it is made of is measured: a masked one is never read.
    """
    grid = table.layout
    if not isinstance(grid, HalfDifferenceGrid):
        raise TypeError("interpolation needs a half/difference grid")
    th, td, pd, ph = half_difference(wi, wo)
    axes = [
        _bracket(np.sqrt(grid.theta_h), np.sqrt(th)),
        _bracket(grid.theta_d, td),
        _bracket(grid.phi_d, pd, float(grid.phi_d_edges[-1] - grid.phi_d_edges[0])),
    ]
    if grid.phi_h is not None and grid.phi_h_edges is not None:
        axes.insert(0, _bracket(grid.phi_h, ph, float(grid.phi_h_edges[-1] - grid.phi_h_edges[0])))
    total = np.zeros((table.channels, len(th)))
    known = (wi[:, 2] > 0) & (wo[:, 2] > 0)
    for corner in np.ndindex(*(2,) * len(axes)):
        weight = np.prod([t if side else 1 - t for side, (_, _, t) in zip(corner, axes, strict=True)], axis=0)
        index = tuple(b if side else a for side, (a, b, _) in zip(corner, axes, strict=True))
        used = weight > 1e-6
        real = table.mask[index]
        known &= real | ~used
        for plane, out in zip(table.planes, total, strict=True):
            out += weight * np.where(used & real, plane[index], 0.0)
    return np.where(known, total, np.nan).T


def _bracket(nodes: Reals, x: Reals, period: float | None = None) -> tuple[NDArray[np.intp], NDArray[np.intp], Reals]:
    """Indices of the nodes on either side of ``x`` and how far between them it lies; the ends hold beyond the range."""
    n = len(nodes)
    if period is not None:
        x = nodes[0] + np.mod(x - nodes[0], period)
        nodes = np.append(nodes, nodes[0] + period)
    elif n == 1:
        zero = np.zeros(x.shape, np.intp)
        return zero, zero, np.zeros(x.shape)
    low = np.clip(np.searchsorted(nodes, x, side="right") - 1, 0, len(nodes) - 2)
    t = np.clip((x - nodes[low]) / (nodes[low + 1] - nodes[low]), 0.0, 1.0)
    return low, (low + 1) % n, t


def _in_plane(theta: Reals, phi: float = 0.0) -> Reals:
    """Unit vectors in the plane y = 0; negative angles lie on the other side of the normal."""
    return np.stack([np.sin(theta) * np.cos(phi), np.zeros_like(theta), np.sin(np.pi / 2 - np.abs(theta))], -1)


def _lobe_directions(table: Table, missing: dict[str, str]) -> tuple[tuple[Reals, Reals], Reals, Reals, Reals, str] | None:
    """((theta_i, theta_o) in degrees, lights, viewers, measured, how) of the lobes, None where they cannot be had."""
    grid = table.layout
    if isinstance(grid, HalfDifferenceGrid):
        theta_i = np.array(INCIDENCE)
        near = np.concatenate([[0.0], np.geomspace(0.02, 12, 44)])
        rest = np.arange(-89.0, 90.0)
        theta_o = []
        for angle in theta_i:
            peak = np.concatenate([angle + near, angle - near[1:]])
            row = np.sort(np.concatenate([rest[np.abs(rest - angle) > 1e-9], peak]))
            theta_o.append(np.clip(row, -89.0, 89.0))
        to = np.array(theta_o)
        # The light lies at -x, so that viewers at +x are on the mirror side.
        wi = np.repeat(_in_plane(-np.radians(theta_i)), to.shape[1], axis=0)
        wo = _in_plane(np.radians(to)).reshape(-1, 3)
        how = (
            "Measured values are interpolated linearly between the nearest cells, in the square root of theta_h, in theta_d "
            "and in phi_d; the curve breaks where one of those cells is not measured."
        )
        return (theta_i, to), wi, wo, interpolate(table, wi, wo), how
    if isinstance(grid, SphericalGrid) and grid.isotropic:
        forward = int(np.argmin(np.abs(_turn(grid.phi_o - np.pi))))
        backward = int(np.argmin(np.abs(_turn(grid.phi_o))))
        off = max(abs(_turn(grid.phi_o[forward] - np.pi)), abs(_turn(grid.phi_o[backward])))
        if off > np.radians(10):
            missing["lobes"] = "the table has no directions within 10° of the plane of incidence"
            return None
        rows = sorted({int(np.argmin(np.abs(grid.theta_i - np.radians(a)))) for a in INCIDENCE})
        theta_i = grid.theta_i[rows]
        to = np.concatenate([-grid.theta_o[::-1], grid.theta_o])
        planes = np.where(table.mask, table.planes, np.nan)[:, rows]
        both = np.concatenate([planes[:, :, ::-1, backward], planes[:, :, :, forward]], axis=2)
        wi = np.repeat(_in_plane(-theta_i), len(to), axis=0)
        wo = np.tile(_in_plane(to), (len(rows), 1))
        how = (
            f"Measured values are those of the cells nearest to the plane of incidence, within {np.degrees(off):.1f}° of it."
        )
        shape = (len(rows), len(to))
        return (
            (np.degrees(theta_i), np.degrees(np.broadcast_to(to, shape))),
            wi,
            wo,
            np.moveaxis(both, 0, -1).reshape(-1, table.channels),
            how,
        )
    missing["lobes"] = "lobes need values in planes of incidence, and the samples of this table do not lie on such a grid"
    return None


def _turn(angle: Any) -> Any:
    """An angle in (-pi, pi]."""
    return np.angle(np.exp(1j * np.asarray(angle)))


def sphere_directions() -> tuple[NDArray[np.uint8], Reals, Reals]:
    """Which pixels are lit, and light and viewer in the frame of the surface at each lit pixel."""
    x = (np.arange(PIXELS) + 0.5) / PIXELS * 2 - 1
    x, y = np.meshgrid(x * 1.02, -x * 1.02)
    inside = x**2 + y**2 < 1
    n = np.stack([x, y, np.sqrt(np.maximum(1 - x**2 - y**2, 0))], -1)
    light = LIGHT / np.linalg.norm(LIGHT)
    state = np.where(inside, np.where(n @ light > 0, 1, 2), 0).astype(np.uint8)
    n = n[state == 1]
    t = np.cross([0.0, 1.0, 0.0], n)  # tangents run along the circles of latitude
    t /= np.linalg.norm(t, axis=1, keepdims=True)
    b = np.cross(n, t)
    frame = np.stack([t, b, n], 1)
    return state, frame @ light, frame @ np.array([0.0, 0.0, 1.0])


def sphere(table: Table, at: tuple[NDArray[np.uint8], Reals, Reals], values: Reals, missing: dict[str, str]) -> Sphere:
    """A sphere of the table and of fits with ``values [M, n, C]`` at :func:`sphere_directions`."""
    state, wi, wo = at
    if isinstance(table.layout, HalfDifferenceGrid):
        measured = interpolate(table, wi, wo)
    else:
        measured = np.full((len(wi), table.channels), np.nan)
        missing["sphere"] = "the measured sphere needs a half/difference grid to be interpolated on; only the fits are shown"
    cosine = wi[:, 2:3]
    measured, fitted = measured * cosine, values * cosine
    exposure = exposure_of(measured if np.isfinite(measured).any() else fitted.reshape(-1, table.channels))
    shown = screen(measured, exposure)
    difference = np.stack([delta_e(screen(f, exposure), shown) for f in fitted]) if len(fitted) else np.zeros((0, len(wi)))
    return Sphere(LIGHT, state, measured, fitted, difference, exposure)


def _albedo(table: Table, at: tuple[Reals, Reals, list[list[Reals]]], values: Reals) -> Albedo:
    wi, wo, weights = at
    pairs = [albedo_of_values(v, weights) for v in values]
    shape = (0, len(ANGLES), table.channels)
    fitted = np.stack([p[0] for p in pairs]) if pairs else np.zeros(shape)
    error = np.stack([p[1] for p in pairs]) if pairs else np.zeros(shape)
    # nansum turned fits without a model into 0
    gone = np.isnan(values).all((1, 2))
    fitted[gone] = error[gone] = np.nan
    if isinstance(table.layout, HalfDifferenceGrid):
        m = interpolate(table, wi, wo)
        measured = albedo_of_values(m, weights)[0]
        covered = albedo_of_values(np.where(np.isnan(m[:, :1]), 0.0, 1.0), weights)[0][:, 0] / np.pi
    else:
        measured, covered = np.full((len(ANGLES), table.channels), np.nan), np.zeros(len(ANGLES))
    return Albedo(np.array(ANGLES), measured, covered, fitted, error)


def _cells(
    table: Table, max_angle: float
) -> tuple[Reals, Reals, Reals, NDArray[np.bool_], NDArray[np.intp], Reals, Reals, str]:
    """A sample of the table's cells: directions, values ``[n, C]``, which are fitted, bin, edges in degrees, in words."""
    grid = table.layout
    kept = table.within(np.radians(max_angle))
    if isinstance(grid, HalfDifferenceGrid):
        h, d, p = grid.shape[-3:]
        step_h, step_d, step_p = max(1, h // 90), max(1, d // 45), max(1, p // 12)
        sub = (slice(None, None, step_h), slice(None, None, step_d), slice(None, None, step_p))
        th, td, pd = grid.theta_h[sub[0]], grid.theta_d[sub[1]], grid.phi_d[sub[2]]
        index: tuple[slice, ...] = sub
        ph = np.zeros(1)
        if grid.phi_h is not None:
            step_q = max(1, grid.shape[0] // 6)
            index, ph = (slice(None, None, step_q), *sub), grid.phi_h[::step_q]
        wi, wo = directions(th[:, None, None], td[:, None], pd, ph[:, None, None, None])
        wi, wo = wi.reshape(-1, 3), wo.reshape(-1, 3)
        values = table.planes[(slice(None), *index)].reshape(table.channels, -1).T
        used = kept[index].ravel()
        cell = np.arange(len(th) * len(td)).reshape(len(th), len(td), 1)
        which = np.broadcast_to(cell, (len(ph), len(th), len(td), len(pd))).ravel()
        edges_h = np.append(grid.theta_h_edges[:-1][sub[0]], grid.theta_h_edges[-1])
        edges_d = np.append(grid.theta_d_edges[:-1][sub[1]], grid.theta_d_edges[-1])
        part = f"{len(th)} \u00d7 {len(td)} \u00d7 {len(pd)} of {h} \u00d7 {d} \u00d7 {p} cells"
        how = f"From {part} (theta_h \u00d7 theta_d \u00d7 phi_d), as far as both polar angles are below {max_angle:g}°."
    else:
        all_i, all_o = grid.directions()
        step = max(1, int(np.prod(grid.shape)) // 50_000)
        wi, wo = all_i.reshape(-1, 3)[::step], all_o.reshape(-1, 3)[::step]
        values = table.planes.reshape(table.channels, -1)[:, ::step].T
        used = kept.ravel()[::step]
        edges_h, edges_d = np.radians(90) * np.linspace(0, 1, 31) ** 2, np.radians(np.linspace(0, 90, 31))
        a_h, a_d, _, _ = half_difference(wi, wo)
        bins = [np.clip(np.searchsorted(e, a, side="right") - 1, 0, 29) for e, a in ((edges_h, a_h), (edges_d, a_d))]
        which = bins[0] * 30 + bins[1]
        how = f"{len(wi)} samples in bins of theta_h and theta_d, as far as both polar angles are below {max_angle:g}°."
    return wi, wo, values, used, which, np.degrees(edges_h), np.degrees(edges_d), how


def _maps(fitted: Reals, cells: tuple[Reals, Reals, Reals, NDArray[np.bool_], NDArray[np.intp], Reals, Reals, str]) -> Maps:
    wi, _, values, used, which, edges_h, edges_d, how = cells
    shape = (len(edges_h) - 1, len(edges_d) - 1)
    cosine = wi[used, 2:3]
    target = np.log1p(values[used] * cosine)
    count = np.bincount(which[used], minlength=shape[0] * shape[1])
    signed, rms = [], []
    for f in fitted:
        with np.errstate(invalid="ignore", divide="ignore"):
            r = np.log1p(f[used] * cosine) - target
            mean = np.bincount(which[used], r.mean(1), len(count)) / count
            square = np.bincount(which[used], (r**2).mean(1), len(count)) / count
        signed.append(mean.reshape(shape))
        rms.append(np.sqrt(square).reshape(shape))
    empty = np.zeros((0, *shape))
    return Maps(edges_h, edges_d, np.stack(signed) if signed else empty, np.stack(rms) if rms else empty, how)


__all__ = ["Views", "fit_key", "gather", "interpolate", "sphere", "sphere_directions"]
