"""Half/difference angles and unit vectors, one from the other (Rusinkiewicz 1998).

With l and v the unit vectors to light and viewer and h = (l + v)/|l + v|: (theta_h, phi_h) are the polar angles of h, and
(theta_d, phi_d) those of l once the rotation that takes h to the normal has been applied to it. NumPy float64 only.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Reals = NDArray[np.float64]


def unit_vectors(theta: ArrayLike, phi: ArrayLike) -> Reals:
    """Unit vectors ``[..., 3]`` of polar angles and azimuths in radians that broadcast; z is the normal."""
    t, p = np.broadcast_arrays(np.asarray(theta, float), np.asarray(phi, float))
    # cos(theta) as the sine of the complement keeps its digits at grazing
    return np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.sin(np.pi / 2 - t)], -1)


def directions(theta_h: ArrayLike, theta_d: ArrayLike, phi_d: ArrayLike, phi_h: ArrayLike = 0.0) -> tuple[Reals, Reals]:
    """Unit vectors ``(wi, wo)``, each ``[..., 3]``, of half/difference angles in radians that broadcast."""
    th, td, pd, ph = np.broadcast_arrays(*(np.asarray(a, float) for a in (theta_h, theta_d, phi_d, phi_h)))
    out = []
    for sign, w in zip((1.0, -1.0), polar_cosines(th, td, pd), strict=True):
        x, y = sign * np.sin(td) * np.cos(pd), sign * np.sin(td) * np.sin(pd)
        # rotate by theta_h about +y, then by phi_h about +z
        u = np.cos(th) * x + np.sin(th) * np.cos(td)
        out.append(np.stack([np.cos(ph) * u - np.sin(ph) * y, np.sin(ph) * u + np.cos(ph) * y, w], -1))
    return out[0], out[1]


def polar_cosines(theta_h: ArrayLike, theta_d: ArrayLike, phi_d: ArrayLike) -> tuple[Reals, Reals]:
    """cos(theta_i) and cos(theta_o) of half/difference angles in radians; negative below the horizon.

    cos(theta_h) cos(theta_d) -+ sin(theta_h) sin(theta_d) cos(phi_d): accurate to the rounding of the angles themselves.
    """
    th, td, pd = (np.asarray(a, float) for a in (theta_h, theta_d, phi_d))
    along = np.cos(th) * np.cos(td)
    across = np.sin(th) * np.sin(td) * np.cos(pd)
    return along - across, along + across


def half_difference(wi: ArrayLike, wo: ArrayLike) -> tuple[Reals, Reals, Reals, Reals]:
    """Angles ``(theta_h, theta_d, phi_d, phi_h)`` in radians of unit vectors ``[..., 3]``; phi in [-pi, pi].

    The angles of a lobe's centre are exact: theta by arctan2 of a length that does not cancel, never by arccos.
    """
    wi, wo = np.broadcast_arrays(np.asarray(wi, float), np.asarray(wo, float))
    total, difference = wi + wo, wi - wo
    theta_h = np.arctan2(np.hypot(total[..., 0], total[..., 1]), total[..., 2])
    theta_d = np.arctan2(np.linalg.norm(difference, axis=-1), np.linalg.norm(total, axis=-1))
    phi_h = np.arctan2(total[..., 1], total[..., 0])
    # (l - v)/2 is l without its component along h: turn it back by phi_h and theta_h
    dx = np.cos(phi_h) * difference[..., 0] + np.sin(phi_h) * difference[..., 1]
    dy = -np.sin(phi_h) * difference[..., 0] + np.cos(phi_h) * difference[..., 1]
    x = np.cos(theta_h) * dx - np.sin(theta_h) * difference[..., 2]
    return theta_h, theta_d, np.arctan2(dy, x), phi_h


__all__ = ["directions", "half_difference", "polar_cosines", "unit_vectors"]
