"""A row of the table as a few cells that stand for all of it.

Along phi_d, at fixed theta_h and theta_d, a loss sees T(f) - T(m) for some transform T, and T(f) of a smooth model is close
to a polynomial p of low degree. Then two facts of the row's own discrete measure (weights w_j at its fitted cells phi_j)
make k cells do the work of all of them, with no cell left out:

- sum_j w_j (p(phi_j) - T(m_j))^2 = sum_j w_j (p(phi_j) - q(phi_j))^2 + a constant, with q the least-squares polynomial
  through the measured row;
- p - q has degree below k, so that k-point Gauss quadrature *for that measure* gives its weighted square sum exactly
  (Golub & Welsch 1969; Gautschi 2004, theorem 1.45).

So each row becomes a few ordinary cells, at the Gauss nodes with the Gauss weights and the value of q, and the constant.
Masks and uneven weights are part of the measure; a row with fewer fitted cells than nodes keeps them as they are. What is
lost is only what T(f) has beyond degree k - 1 in phi_d: the exact table judges that at the solution.

At phi_d = 90 degrees light and viewer change places, and with them the two sides of every max(n.l, n.v): many models have a
kink there, which no polynomial across it follows. Each half of a row therefore has its own polynomial and its own rule.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Reals = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RowRules:
    """Gauss rules for all rows of a table. Rows with the same fitted cells and relative weights share one: a MERL table
    has some ninety.
    """

    pattern: NDArray[np.intp]
    """Which rule each row uses, ``[H, D]``."""
    scale: Reals
    """Weight of each row relative to its rule, ``[H, D]``."""
    nodes: Reals
    """phi of the nodes, ``[rules, k]``, radians in [0, pi]."""
    weights: Reals
    """Weights of the nodes, ``[rules, k]``."""
    analysis: Reals
    """w_j p_l(phi_j), ``[rules, P, l]``: coefficients of a row's values in the orthonormal polynomials."""
    synthesis: Reals
    """p_l at the nodes, ``[rules, l, k]``."""

    @property
    def phi(self) -> Reals:
        """Nodes ``[H, D, k]``."""
        return np.asarray(self.nodes[self.pattern])

    @property
    def weight(self) -> Reals:
        """Weights ``[H, D, k]``."""
        return np.asarray(self.weights[self.pattern] * self.scale[..., None])

    @cached_property
    def same(self) -> list[tuple[int, NDArray[np.intp]]]:
        """Each rule with its rows, numbered over ``[H, D]``."""
        order = np.argsort(self.pattern, axis=None, kind="stable")
        pattern = self.pattern.ravel()[order]
        starts = np.flatnonzero(np.diff(pattern, prepend=-1))
        return [(int(pattern[a]), order[a:b]) for a, b in zip(starts, [*starts[1:], len(order)], strict=True)]

    def compress(self, rows: Reals) -> tuple[Reals, float]:
        """Values ``[H D, k]`` at the nodes, from the transformed values ``[H D, P]`` of a channel; and the weighted square
        sum that they stand for.
        """
        out, kept = np.empty((len(rows), self.nodes.shape[1])), 0.0
        for rule, at in self.same:
            coefficients = rows[at] @ self.analysis[rule]
            out[at] = coefficients @ self.synthesis[rule]
            kept += float((coefficients**2).sum(-1) @ self.scale.ravel()[at])
        return out, kept


MIDDLE = np.pi / 2 + 1e-9
"""Where light and viewer change places: the end of the first half of a row, rounding included."""


def row_rules(phi: Reals, weight: Reals, k: int) -> RowRules:
    """The rules of the rows of weights ``[H, D, P]`` at ``phi`` ``[P]`` in [0, pi], k points in all."""
    scale = weight.max(-1)
    # rounded: the steps of a grid differ in their last bits
    relative = np.round(weight / np.where(scale > 0, scale, 1.0)[..., None], 12)
    flat = np.ascontiguousarray(relative.reshape(-1, relative.shape[-1]))
    bytes_of_row = flat.view(np.dtype((np.void, flat.dtype.itemsize * flat.shape[1])))[:, 0]
    _, first, pattern = np.unique(bytes_of_row, return_index=True, return_inverse=True)
    half = k - k // 2
    near, far = _rules(phi, flat[first] * (phi <= MIDDLE), half), _rules(phi, flat[first] * (phi > MIDDLE), k // 2)
    nodes, weights, analysis = (np.concatenate([near[i], far[i]], -1) for i in range(3))
    synthesis = np.zeros((len(first), k, k))
    synthesis[:, :half, :half], synthesis[:, half:, half:] = near[3], far[3]
    return RowRules(pattern.reshape(scale.shape), scale, nodes, weights, analysis, synthesis)


def _rules(phi: Reals, weight: Reals, k: int) -> tuple[Reals, Reals, Reals, Reals]:
    """Nodes, weights, analysis and synthesis of the measures ``[rules, P]``."""
    fitted = weight > 0
    empty = ~fitted.any(-1, keepdims=True)
    low = np.where(empty, 0.0, np.where(fitted, phi, np.inf).min(-1, keepdims=True))
    high = np.where(empty, np.pi, np.where(fitted, phi, -np.inf).max(-1, keepdims=True))
    centre, half = (low + high) / 2, np.where(high > low, (high - low) / 2, 1.0)
    x = (phi - centre) / half
    mass = weight.sum(-1)
    # three-term recurrence of the orthonormal polynomials (Lanczos, Gautschi 2004, algorithm 2.1)
    alpha, beta = np.zeros((len(mass), k)), np.zeros((len(mass), k))
    before = np.zeros_like(x)
    p = np.where(fitted, 1 / np.sqrt(np.where(mass > 0, mass, 1.0))[:, None], 0.0)
    analysis = np.empty((*weight.shape, k))
    for degree in range(k):
        weighted = weight * p
        analysis[..., degree] = weighted
        alpha[:, degree] = (weighted * p * x).sum(-1)
        q = (x - alpha[:, degree, None]) * p - np.sqrt(beta[:, degree, None]) * before
        size = (weight * q * q).sum(-1)
        # a row of n cells has n polynomials: what is left of the next one is rounding (1e-13 of a row scaled to [-1, 1])
        live = size > 1e-20
        before, p = p, np.where(live[:, None], q / np.sqrt(np.where(live, size, 1.0))[:, None], 0.0)
        if degree + 1 < k:
            beta[:, degree + 1] = np.where(live, size, 0.0)
    jacobi = np.zeros((len(mass), k, k))
    diagonal = np.arange(k)
    jacobi[:, diagonal, diagonal] = alpha
    jacobi[:, diagonal[1:], diagonal[:-1]] = np.sqrt(beta[:, 1:])
    nodes, vectors = np.linalg.eigh(jacobi)  # reads the lower triangle
    first = vectors[:, 0, :]
    seen = np.abs(first) > 1e-14
    size = np.where(seen, first, 1.0) * np.sqrt(np.where(mass > 0, mass, 1.0))[:, None]
    synthesis = np.where(seen[:, None, :], vectors / size[:, None, :], 0.0)
    weights = np.where(seen, mass[:, None] * first**2, 0.0)
    return np.clip(centre + half * nodes, low, high), weights, analysis, synthesis
