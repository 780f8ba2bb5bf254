"""Where synthetic tables have their samples."""

from __future__ import annotations

import numpy as np

from ...angles import directions
from ...errors import InputError
from ...tables.layout import HalfDifferenceGrid, Scattered
from ...tables.merl import Angles, merl_grid


def grid(shape: tuple[int, ...], angles: Angles = "edge") -> HalfDifferenceGrid:
    """The MERL grid with ``(H, D, P)`` cells, or with the azimuth of the half vector over 360 degrees as a first axis.

    phi_d runs over 180 degrees: reciprocity gives the rest. ``angles`` says where in a cell its value holds.
    Raises InputError for shapes of other lengths or without cells.
    """
    if len(shape) not in (3, 4) or min(shape) < 1:
        raise InputError(f"a grid has cells along theta_h, theta_d, phi_d and perhaps, first, phi_h; {shape} is none")
    base = merl_grid(shape[-3:], angles=angles, phi_period=180)  # type: ignore[arg-type]
    if len(shape) == 3:
        return base
    edges = np.linspace(0, 2 * np.pi, shape[0] + 1)
    positions = edges[:-1] if angles == "edge" else (edges[:-1] + edges[1:]) / 2
    axes = (base.theta_h, base.theta_d, base.phi_d, base.theta_h_edges, base.theta_d_edges, base.phi_d_edges)
    return HalfDifferenceGrid(*axes, phi_h=positions, phi_h_edges=edges)


def scattered(count: int, seed: int = 0) -> Scattered:
    """``count`` pairs of random directions above the horizon, dense around the mirror direction as the MERL grid is.

    theta_h = (u^2) 90 deg; theta_d, phi_d and phi_h are uniform. The measure of a sample is 1/(N density), N the draws
    made: its sum estimates the (2 pi)^2 of all pairs. Raises InputError for a count below 1.
    """
    if count < 1:
        raise InputError(f"a table has at least 1 sample, not {count}")
    # 76 % of the draws are above the horizon: fewer than half of 2 count + 64 never happens (below 1e-38 for any count)
    u = np.random.default_rng(seed).random((2 * count + 64, 4))
    theta_h, theta_d = u[:, 0] ** 2 * np.pi / 2, u[:, 1] * np.pi / 2
    wi, wo = directions(theta_h, theta_d, u[:, 2] * 2 * np.pi, u[:, 3] * 2 * np.pi)
    above = np.flatnonzero((wi[:, 2] > 0) & (wo[:, 2] > 0))[:count]
    drawn = above[-1] + 1
    # dl dv over the density of the draw, d theta_h = pi u du
    solid = 4 * np.cos(theta_d) * np.sin(theta_h) * np.sin(theta_d)
    measure = solid * (np.pi * u[:, 0]) * (np.pi / 2) * (2 * np.pi) ** 2 / drawn
    return Scattered(wi[above], wo[above], measure[above])
