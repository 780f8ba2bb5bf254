"""Cylinders on a floor (Poulin & Fournier 1990) in 40-digit arithmetic, from circles and the rays that touch them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from mpmath import mp, mpf

from . import oracle

Vector = Sequence[Any]

NODES = 28
FAINT = 36  # e^-36 of the highest of a lobe, 2e-16, is left out; both err by 1e-13 at most


def _arc(w: Vector, spacing: Any, elevation: Any) -> tuple[Any, Any]:
    """From which to which normal a cylinder is free to w, as angles from that of the floor."""
    lean = mp.atan2(w[1], w[2])
    first, last = lean - mp.pi / 2, lean + mp.pi / 2
    # a ray from theta passes the axis at sin(theta - lean), and has to pass that of the next cylinder at 1 or more
    clearance = spacing * mp.cos(lean) - 1
    if clearance < 1 and lean > 0:
        last = lean + mp.asin(clearance)
    elif clearance < 1:
        first = lean - mp.asin(clearance)
    above = mp.acos(-min(elevation, 1))  # a difference quotient goes beyond 1, where all of the circle is above the floor
    return max(first, -above), min(last, above)


def _strip(w: Vector, spacing: Any, elevation: Any) -> tuple[Any, Any]:
    """From where to where the floor between the axes at 0 and at ``spacing`` is free to w."""
    slope, lean = w[1] / w[2], mp.atan2(w[1], w[2])

    def edge(side: int) -> Any:
        """Where the ray along w that touches a cylinder on this side comes down; its foot where it touches below."""
        y, z = side * mp.cos(lean), elevation - side * mp.sin(lean)
        return y - z * slope if z > 0 else side * mp.sqrt(1 - min(elevation, 1) ** 2)

    return edge(1), spacing + edge(-1)


def _lobe(e: Any, l: Vector, v: Vector, first: Any, last: Any) -> Any:  # noqa: E741
    """int (m.h)^e (m.l)(m.v) dtheta by Gauss's rule, from where the lobe is highest to either end of the arc, in the root of
    the angle from that end, where the integrand may end in a power that is no integer.
    """
    total = [a + b for a, b in zip(l, v, strict=True)]
    length = mp.sqrt(mp.fsum(a * a for a in total))
    lean, planar = mp.atan2(total[1], total[2]), mp.hypot(total[1], total[2]) / length
    low, high = first - lean, last - lean
    top = min(max(low, mpf(0)), high)
    reach = mp.acos(mp.exp(-FAINT / e) * mp.cos(top)) if e > 0 else mp.pi / 2
    out = mpf(0)
    for end in (max(low, -reach), min(high, reach)):
        span = top - end
        for x, weight in oracle.gauss_legendre(NODES) if span else ():
            t = end + span * x * x
            y, z = mp.sin(t + lean), mp.cos(t + lean)
            facing = (y * l[1] + z * l[2]) * (y * v[1] + z * v[2])
            out += abs(span) * 2 * x * weight * (planar * mp.cos(t)) ** e * facing
    return out


def poulin_fournier(
    l: Vector,  # noqa: E741
    v: Vector,
    diffuse: Any,
    specular: Any,
    exponent: Any,
    spacing: Any,
    elevation: Any,
) -> Any:
    """What is lit and seen of a cylinder and of the floor beside it, over all there is."""
    (first, last), (first_v, last_v) = (_arc(w, spacing, elevation) for w in (l, v))
    first, last = max(first, first_v), min(last, last_v)
    (left, right), (left_v, right_v) = (_strip(w, spacing, elevation) for w in (l, v))
    floor = max(mpf(0), min(right, right_v) - max(left, left_v))

    def antiderivative(theta: Any) -> Any:
        """Of (m.l)(m.v)."""
        squares = [theta / 2 + sign * mp.sin(2 * theta) / 4 for sign in (-1, 1)]
        return l[1] * v[1] * squares[0] + l[2] * v[2] * squares[1] + (l[1] * v[2] + l[2] * v[1]) * mp.sin(theta) ** 2 / 2

    facing = l[2] * v[2]
    h = oracle._half(l, v)
    albedo = oracle.half_vector_albedo(exponent)
    body = diffuse / mp.pi * (antiderivative(last) - antiderivative(first) + floor * facing)
    lobe = specular / albedo * (_lobe(exponent, l, v, first, last) + floor * facing * h[2] ** exponent)
    return (body + lobe) / (spacing * facing)
