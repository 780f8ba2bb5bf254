"""The choices that are worth having: no other one is both cheaper and better."""

from __future__ import annotations

from collections.abc import Sequence


def front(points: Sequence[tuple[float, float]]) -> list[int]:
    """Indices of the points (cost, error) that no other point beats in one and equals or beats in the other, by cost.

    Of equal points only the first is kept; NaN is never kept.
    """
    order = sorted((i for i, p in enumerate(points) if all(v == v for v in p)), key=lambda i: (points[i], i))
    kept: list[int] = []
    for i in order:
        if not kept or points[i][1] < points[kept[-1]][1]:
            kept.append(i)
    return kept


__all__ = ["front"]
