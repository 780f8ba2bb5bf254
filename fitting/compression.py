"""A row of the table as a few cells that stand for all of it.

Along phi_d, at fixed theta_h and theta_d, a loss sees T(f) - T(m) for some transform T, and T(f) of a smooth model is close
to a polynomial p of low degree. Then two facts of the row's own discrete measure (weights w_j at its fitted cells phi_j)
make k cells do the work of all of them, with no cell left out:

- sum_j w_j (p(phi_j) - T(m_j))^2 = sum_j w_j (p(phi_j) - q(phi_j))^2 + a constant, with q the least-squares polynomial
  through the measured row;
- p - q has degree below k, so that k-point Gauss quadrature *for that measure* gives its weighted square sum exactly
  (Golub & Welsch 1969; Gautschi 2004, theorem 1.45).

So each row becomes k ordinary cells, at the Gauss nodes with the Gauss weights and the value of q, and the constant. Masks
and uneven weights are part of the measure; a row with fewer than k fitted cells keeps them as they are. What is lost is
only what T(f) has beyond degree k - 1 in phi_d: the exact table judges that at the solution.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass
from hashlib import blake2b
from threading import Lock

import numpy as np
from numpy.typing import NDArray

Reals = NDArray[np.float64]


@dataclass(frozen=True)
class RowRule:
    """Gauss rules of all rows, and what projects a measured row on its polynomials."""

    phi: Reals
    """Nodes ``[H, D, k]``, radians in [0, pi]."""
    weight: Reals
    """Weights ``[H, D, k]``."""
    analysis: Reals
    """w_j p_l(phi_j), ``[H, D, P, k]``: coefficients of a row's values in the orthonormal polynomials."""
    synthesis: Reals
    """p_l at the nodes, ``[H, D, l, k]``."""

    def project(self, transformed: Reals) -> Reals:
        """Coefficients ``[C, H, D, l]`` of rows ``[C, H, D, P]``."""
        rows = np.moveaxis(transformed, 0, 2)
        return np.moveaxis(rows @ self.analysis, 2, 0)

    def at_nodes(self, coefficients: Reals) -> Reals:
        """Values ``[C, H, D, k]`` at the nodes."""
        return np.moveaxis(np.moveaxis(coefficients, 0, 2) @ self.synthesis, 2, 0)


_rules: OrderedDict[bytes, RowRule] = OrderedDict()
_lock = Lock()


def row_rule(phi: Reals, weight: Reals, k: int) -> RowRule:
    """The k-point rule of every row of weights ``[H, D, P]`` at ``phi`` ``[P]`` in [0, pi].

    The last two are kept: tables of a batch often share grid and mask.
    """
    key = blake2b(weight.tobytes() + phi.tobytes() + bytes([k])).digest()
    with _lock:
        if key not in _rules:
            _rules[key] = _row_rule(phi, weight, k)
            while len(_rules) > 2:
                _rules.popitem(last=False)
        _rules.move_to_end(key)
        return _rules[key]


def _row_rule(phi: Reals, weight: Reals, k: int) -> RowRule:
    fitted = weight > 0
    low = np.where(fitted, phi, np.inf).min(-1, keepdims=True)
    high = np.where(fitted, phi, -np.inf).max(-1, keepdims=True)
    empty = ~fitted.any(-1, keepdims=True)
    centre = np.where(empty, np.pi / 2, (np.where(empty, 0, low) + np.where(empty, 0, high)) / 2)
    half = np.where(empty | (high <= low), 1.0, np.where(empty, 1.0, high - low) / 2)
    x = (phi - centre) / half
    mass = weight.sum(-1)
    # three-term recurrence of the orthonormal polynomials (Lanczos, Gautschi 2004, algorithm 2.1)
    alpha, beta = np.zeros((*mass.shape, k)), np.zeros((*mass.shape, k))
    before = np.zeros_like(x)
    p = np.where(fitted, 1 / np.sqrt(np.where(mass > 0, mass, 1.0))[..., None], 0.0)
    basis = np.empty((*weight.shape, k))
    for degree in range(k):
        weighted = weight * p
        basis[..., degree] = weighted
        alpha[..., degree] = np.einsum("hdp,hdp,hdp->hd", weighted, p, x)
        q = (x - alpha[..., degree, None]) * p - np.sqrt(beta[..., degree, None]) * before
        size = np.einsum("hdp,hdp,hdp->hd", weight, q, q)
        # a row of n cells has n polynomials: what is left of the next one is rounding (1e-13 of a row scaled to [-1, 1])
        live = size > 1e-20
        before, p = p, np.where(live[..., None], q / np.sqrt(np.where(live, size, 1.0))[..., None], 0.0)
        if degree + 1 < k:
            beta[..., degree + 1] = np.where(live, size, 0.0)
    jacobi = np.zeros((*mass.shape, k, k))
    diagonal = np.arange(k)
    jacobi[..., diagonal, diagonal] = alpha
    off = np.sqrt(beta[..., 1:])
    jacobi[..., diagonal[1:], diagonal[:-1]] = off
    nodes, vectors = np.linalg.eigh(jacobi)  # reads the lower triangle
    first = vectors[..., 0, :]
    seen = np.abs(first) > 1e-14
    scale = np.where(seen, first, 1.0) * np.sqrt(np.where(mass > 0, mass, 1.0))[..., None]
    synthesis = np.where(seen[..., None, :], vectors / scale[..., None, :], 0.0)
    phi_nodes = np.clip(centre + half * nodes, np.where(empty, 0, low), np.where(empty, np.pi, high))
    return RowRule(phi_nodes, np.where(seen, mass[..., None] * first**2, 0.0), basis, synthesis)
