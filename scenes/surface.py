"""Where rays meet a shape, and the frame of the surface there. NumPy float64: it is done once for a scene.

Tangents of curved shapes run along the circles about +y (the sphere) or about the axis.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .scene import Frustum, Plane, Reals, Shape, Sphere, unit

UP = np.array([0.0, 1.0, 0.0])


def intersect(shape: Shape, origin: Reals, ray: Reals) -> tuple[Reals, Reals]:
    """Distance to the first visible point along unit rays ``[n, 3]``, infinite where there is none, and normals ``[n, 3]``.

    Points seen from inside or from behind a plane are not visible.
    """
    o = origin - np.asarray(shape.centre)
    # from the point of the ray that is nearest to the centre: from a camera far away the roots would cancel
    # (tests/test_scenes.py::test_perspective_goes_over_into_parallel_rays)
    back = _dot(o, ray)
    o = o - back[:, None] * ray
    if isinstance(shape, Sphere):
        further, normals = _sphere(shape, o, ray, back)
    elif isinstance(shape, Plane):
        further, normals = _plane(shape, o, ray, back)
    else:
        further, normals = _frustum(shape, o, ray, back)
    return further - back, normals


def frames(shape: Shape, normals: Reals) -> Reals:
    """Tangent, bitangent and normal as rows, ``[n, 3, 3]``."""
    about = unit(shape.axis) if isinstance(shape, Frustum) else UP
    tangent = np.cross(about, normals)
    length = np.linalg.norm(tangent, axis=1, keepdims=True)
    # Guard: where the normal is the axis any tangent will do; the one of +x (tests/test_scenes.py::test_frames).
    pole = length < 1e-9
    other = np.array([1.0, 0, 0]) if abs(about[0]) < 0.9 else np.array([0, 0, 1.0])
    other = other - (other @ about) * about
    tangent = np.where(pole, unit(other), tangent / np.where(pole, 1, length))
    return np.stack([tangent, np.cross(normals, tangent), normals], 1)


def _dot(a: Reals, b: Reals) -> Reals:
    return np.asarray((a * b).sum(-1))


def _normals(v: Reals) -> Reals:
    return np.asarray(v / np.linalg.norm(v, axis=-1, keepdims=True))


def _finite(distance: Reals) -> Reals:
    return np.where(np.isfinite(distance), distance, 0.0)


def _sphere(sphere: Sphere, o: Reals, ray: Reals, begin: Reals) -> tuple[Reals, Reals]:
    square = sphere.radius**2 - _dot(o, o)
    further = -np.sqrt(np.maximum(square, 0))
    seen = (square > 0) & (further > begin)
    return np.where(seen, further, np.inf), (o + further[:, None] * ray) / sphere.radius


def _plane(plane: Plane, o: Reals, ray: Reals, begin: Reals) -> tuple[Reals, Reals]:
    n = unit(plane.normal)
    t, b, _ = frames(plane, n[None])[0]
    facing = ray @ n
    distance = np.where(facing < 0, -(o @ n) / np.where(facing < 0, facing, -1), np.inf)
    at = o + _finite(distance)[:, None] * ray
    inside = (distance > begin) & (np.abs(at @ t) <= plane.size[0] / 2) & (np.abs(at @ b) <= plane.size[1] / 2)
    return np.where(inside, distance, np.inf), np.broadcast_to(n, ray.shape)


def _frustum(solid: Frustum, o: Reals, ray: Reals, begin: Reals) -> tuple[Reals, Reals]:
    """Side r(z) = middle + slope z between flat ends at z = -+height/2."""
    axis, half = unit(solid.axis), solid.height / 2
    slope, middle = (solid.top - solid.bottom) / solid.height, (solid.top + solid.bottom) / 2
    oz, dz = o @ axis, ray @ axis
    across, along = o - oz[:, None] * axis, ray - dz[:, None] * axis
    r = middle + slope * oz
    a, b = _dot(along, along) - (slope * dz) ** 2, _dot(across, along) - slope * r * dz
    roots = _roots(a, b, _dot(across, across) - r * r)
    best, normals = np.full(len(ray), np.inf), np.zeros_like(ray)
    for distance in roots:
        z = oz + _finite(distance) * dz
        radial = across + _finite(distance)[:, None] * along
        n = _normals(radial / np.maximum(np.linalg.norm(radial, axis=1, keepdims=True), 1e-300) - slope * axis)
        good = (distance > begin) & (distance < best) & (np.abs(z) <= half) & (_dot(n, ray) < 0) & (middle + slope * z > 0)
        best, normals = np.where(good, distance, best), np.where(good[:, None], n, normals)
    for side, radius in ((1.0, solid.top), (-1.0, solid.bottom)):
        facing = side * dz < 0
        distance = np.where(facing, (side * half - oz) / np.where(facing, dz, 1), np.inf)
        rim = across + _finite(distance)[:, None] * along
        good = (distance > begin) & (distance < best) & (_dot(rim, rim) <= radius**2)
        best, normals = np.where(good, distance, best), np.where(good[:, None], side * axis, normals)
    return best, normals


def _roots(a: Reals, b: Reals, c: Reals) -> tuple[Reals, Reals]:
    """Both roots of a t^2 + 2 b t + c, without cancellation; infinite where there is none."""
    square = b * b - a * c
    real: NDArray[np.bool_] = square > 0
    q = -(b + np.copysign(np.sqrt(np.where(real, square, 0)), b))
    with np.errstate(divide="ignore", invalid="ignore"):
        first, second = (np.where(real & np.isfinite(t), t, np.inf) for t in (q / a, c / q))
    return first, second


__all__ = ["frames", "intersect"]
