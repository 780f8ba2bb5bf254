"""What a scene is: one shape, one camera, lights, an exposure, and how far its picture may be off.

Lengths are in any one unit. Colours are linear, one value or three (red, green, blue). World axes: +y is up where an
environment needs it; otherwise any.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Reals = NDArray[np.float64]
Vector = tuple[float, float, float]

MEASURES = {
    "itp": (3.0, "RMS ΔE ITP"),
    "ciede2000": (0.7, "mean CIEDE2000"),
    "psnr": (38.0, "PSNR of the sRGB picture, dB"),
    "ssim": (0.01, "1 \u2212 SSIM of the sRGB picture"),
    "relative": (0.05, "relative RMS error of radiance"),
}
"""Measures of the difference of two pictures: the default limit and what it is called. PSNR must be at least its limit, the
others at most theirs."""


@dataclass(frozen=True)
class Sphere:
    """All points at ``radius`` from ``centre``."""

    centre: Vector = (0.0, 0.0, 0.0)
    radius: float = 1.0


@dataclass(frozen=True)
class Plane:
    """A rectangle of ``size`` (along the tangent and across it) about ``centre``, seen and lit from the side of ``normal``.

    The tangent is the horizontal direction of the plane: up x normal, with +y up (+x for a plane that faces up or down).
    """

    centre: Vector = (0.0, 0.0, 0.0)
    normal: Vector = (0.0, 0.0, 1.0)
    size: tuple[float, float] = (2.0, 2.0)


@dataclass(frozen=True)
class Frustum:
    """A solid of circular sections about ``axis``, from ``bottom`` to ``top`` radius over ``height``, with flat ends.

    A cylinder has two equal radii, a cone the top radius 0. ``centre`` is half way up.
    """

    centre: Vector = (0.0, 0.0, 0.0)
    axis: Vector = (0.0, 1.0, 0.0)
    height: float = 2.0
    bottom: float = 1.0
    top: float = 1.0


Shape = Sphere | Plane | Frustum
"""All shapes are convex: a point is lit by whatever stands above its horizon, and nothing casts a shadow on it."""


@dataclass(frozen=True)
class Camera:
    """A camera at ``eye`` that looks at ``target``. One ray goes through the middle of each pixel."""

    eye: Vector = (0.0, 0.0, 5.0)
    target: Vector = (0.0, 0.0, 0.0)
    up: Vector = (0.0, 1.0, 0.0)
    pixels: tuple[int, int] = (256, 256)
    """Width and height of the picture."""
    width: float | None = 2.2
    """Width of the picture in the world, for parallel rays; None for a perspective camera."""
    field: float | None = None
    """Horizontal field of view of a perspective camera, degrees; None for parallel rays."""


@dataclass(frozen=True)
class Directional:
    """Parallel light from ``direction`` (it points to the light). ``irradiance`` is that of a surface facing the light:
    pi times c_light of Hoffman 2013, eq. 13.
    """

    direction: Vector
    irradiance: Vector


@dataclass(frozen=True)
class Point:
    """Light from one point: irradiance ``intensity`` / distance^2 of a surface that faces it."""

    position: Vector
    intensity: Vector


@dataclass(frozen=True)
class Area:
    """A sphere that emits ``radiance`` evenly."""

    centre: Vector
    radius: float
    radiance: Vector


@dataclass(frozen=True)
class Ambient:
    """The same ``radiance`` from everywhere."""

    radiance: Vector


@dataclass(frozen=True, eq=False)
class Environment:
    """Light from far away by an image of all directions, ``[rows, columns, 3]`` of radiance.

    Rows run from +y (up) to -y; columns go around by atan2(x, -z), so that the left edge is towards -z and a quarter of the
    width further is +x. The radiance is that of the pixel a direction falls into.
    """

    image: Reals
    source: str = ""


Light = Directional | Point | Area | Ambient | Environment


@dataclass(frozen=True)
class Tolerance:
    """How far a picture may be from that of the measured table."""

    measure: str = "itp"
    """A key of :data:`MEASURES`."""
    limit: float = 3.0

    def met(self, error: float) -> bool:
        """Whether an error, in the units of the measure, is allowed."""
        return error >= self.limit if self.measure == "psnr" else error <= self.limit


@dataclass(frozen=True)
class Scene:
    """One object under its lights, and what is asked of its picture."""

    name: str
    shape: Shape
    camera: Camera
    lights: tuple[Light, ...]
    exposure: float | None = None
    """Factor from radiance to the screen, where 1 is white; None takes the mean of a white Lambertian surface to 0.8."""
    tolerance: Tolerance = Tolerance()
    budget: float | None = None
    """Nanoseconds that the BRDF may take for one pixel; None for no limit."""
    samples: int = 64
    """Directions of each sort of sampling for each pixel; only scenes with area lights or images of light have any."""


def unit(v: Vector | Reals) -> Reals:
    """The direction of a vector that is not 0."""
    a = np.asarray(v, float)
    return np.asarray(a / np.linalg.norm(a))


__all__ = [
    "MEASURES",
    "Ambient",
    "Area",
    "Camera",
    "Directional",
    "Environment",
    "Frustum",
    "Light",
    "Plane",
    "Point",
    "Scene",
    "Shape",
    "Sphere",
    "Tolerance",
    "unit",
]
