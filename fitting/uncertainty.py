"""How sure the parameters are: two answers, because on a million cells the noise is never what limits.

``stderr`` is statistical: the sandwich H^-1 M H^-1 (White 1980) with H = J^T W J and M the sum of squared cell gradients,
right when the noise varies over the table, if it is independent from cell to cell. ``spread`` is a delete-one-block
jackknife over bands of (theta_h, theta_d): it sees whatever a model that cannot reproduce the table trades off between
angles. Each deletion takes one Gauss-Newton step from the optimum, with the bounds that are active held.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Reals = NDArray[np.float64]

SINGULAR = 1e-11
"""Eigenvalue of the unit-diagonal J^T W J, relative to the largest, below which a direction is not determined: the Gram
matrix is a sum of squares accurate to about 1e-13 of its diagonal."""


@dataclass(frozen=True)
class Uncertainty:
    """Covariance matrices A A^T in coordinates by their factors A ``[n, m]``, because a variance formed as a sum of squares
    is never negative; rows of coordinates that are held are 0.
    """

    statistical: Reals
    jackknife: Reals
    undetermined: NDArray[np.bool_]
    """Coordinates that the data do not determine."""
    shift: Reals
    """The Gauss-Newton step from here, in standard errors; 0 for what cannot move."""
    gain: float = 0.0
    """Share of the error that this step would take off."""


def unknown(n: int) -> Uncertainty:
    """Of n coordinates of which nothing was asked."""
    return Uncertainty(np.full((n, n), np.nan), np.full((n, 1), np.nan), np.zeros(n, bool), np.full(n, np.nan), np.nan)


def uncertainty(bands: Reals, middle: Reals, moving: NDArray[np.bool_]) -> Uncertainty:
    """From Gram matrices of the bands ``[B, n+1, n+1]``, the sandwich's middle ``[n, n]`` and which coordinates move."""
    n = middle.shape[0]
    total = bands.sum(0)
    undetermined = np.zeros(n, bool)
    statistical, jackknife, shift = np.zeros((n, n)), np.zeros((n, 1)), np.zeros(n)
    moving = moving & np.isfinite(total).all(0)[:n]
    undetermined |= moving & ~(np.diag(total)[:n] > 0)
    at = np.flatnonzero(moving & ~undetermined)
    if not len(at):
        return Uncertainty(statistical, jackknife, undetermined, shift)
    inverse, null = _pseudo_inverse(total[np.ix_(at, at)])
    undetermined[at] = null
    statistical[np.ix_(at, at)] = inverse @ _root(middle[np.ix_(at, at)])
    used = bands[bands[:, :n, :n].trace(axis1=1, axis2=2) > 0]
    steps = np.stack([_delete(total - band, at) for band in used]) if len(used) > 1 else np.zeros((1, len(at)))
    deviation = steps - steps.mean(0)
    count = len(steps)
    jackknife = np.zeros((n, count))
    jackknife[at] = np.sqrt((count - 1) / count) * deviation.T
    errors = np.linalg.norm(statistical[at], axis=1)
    step = _delete(total, at)
    with np.errstate(divide="ignore", invalid="ignore"):
        shift[at] = np.where(step != 0, np.abs(step) / errors, 0.0)
    cost = float(total[-1, -1])
    gain = -float(total[at, -1] @ step) / (2 * cost) if cost > 0 else 0.0  # half: the error is the root of the cost
    return Uncertainty(statistical, jackknife, undetermined, shift, gain)


def _delete(rest: Reals, at: NDArray[np.int64]) -> Reals:
    """Gauss-Newton step to the optimum of the cells that are left."""
    inverse, _ = _pseudo_inverse(rest[np.ix_(at, at)])
    step: Reals = -inverse @ rest[at, -1]
    return step


def _root(matrix: Reals) -> Reals:
    """A with A A^T = matrix, positive semidefinite up to rounding."""
    diagonal = np.diag(matrix)
    scale = np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    values, vectors = np.linalg.eigh(matrix / scale[:, None] / scale)
    root: Reals = scale[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
    return root


def _pseudo_inverse(matrix: Reals) -> tuple[Reals, NDArray[np.bool_]]:
    """Inverse on the directions that are determined, and which rows take part in one that is not."""
    diagonal = np.diag(matrix)
    scale = np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    values, vectors = np.linalg.eigh(matrix / scale[:, None] / scale)
    null = values < SINGULAR * values[-1]
    kept = vectors[:, ~null]
    inverse = (kept / values[~null]) @ kept.T / scale[:, None] / scale
    return inverse, (vectors[:, null] ** 2).sum(1) > 0.05
