"""What the camera sees: the pixels of the object, where their points lie, and the frame of the surface there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .scene import Camera, Reals, Scene, unit
from .surface import frames, intersect


@dataclass(frozen=True, eq=False)
class View:
    """The P pixels of the object, row by row from the top left."""

    object: NDArray[np.bool_]
    """Which pixels show the object, ``[rows, columns]``."""
    position: Reals
    """World coordinates, ``[P, 3]``."""
    frame: Reals
    """Tangent, bitangent and normal as rows, ``[P, 3, 3]``."""
    wo: Reals
    """Unit vectors to the camera in the frame of the surface, ``[P, 3]``."""

    def picture(self, values: NDArray[np.floating], empty: float = 0.0) -> Reals:
        """Values ``[P, C]`` at their places, ``[rows, columns, C]``."""
        out = np.full((*self.object.shape, values.shape[-1]), empty)
        out[self.object] = values
        return out


def view(scene: Scene) -> View:
    """The view of a scene's camera. Raises InputError if no pixel shows the object."""
    origin, ray = _rays(scene.camera)
    distance, normals = intersect(scene.shape, origin, ray)
    seen = np.isfinite(distance) & ((normals * ray).sum(-1) < 0)
    if not seen.any():
        raise InputError(f"scene {scene.name!r}: no pixel shows the object; move the camera or widen its picture")
    frame = frames(scene.shape, normals[seen])
    position = origin[seen] + distance[seen, None] * ray[seen]
    w, h = scene.camera.pixels
    return View(seen.reshape(h, w), position, frame, to_local(frame, -ray[seen]))


def to_local(frame: Reals, world: Reals) -> Reals:
    """World vectors ``[P, 3]`` (or one, ``[3]``) in frames ``[P, 3, 3]``."""
    return np.asarray(np.einsum("pij,pj->pi", frame, np.broadcast_to(world, (len(frame), 3))))


def _rays(camera: Camera) -> tuple[Reals, Reals]:
    """Origins and unit directions through the middles of the pixels, ``[rows columns, 3]``."""
    eye = np.asarray(camera.eye)
    forward = unit(np.subtract(camera.target, eye))
    right = unit(np.cross(forward, camera.up))
    up = np.cross(right, forward)
    w, h = camera.pixels
    x, y = np.meshgrid((np.arange(w) + 0.5) / w * 2 - 1, (1 - (np.arange(h) + 0.5) / h * 2) * (h / w))
    offset = x.reshape(-1, 1) * right + y.reshape(-1, 1) * up
    if camera.field is None:
        assert camera.width is not None
        return eye + offset * camera.width / 2, np.broadcast_to(forward, offset.shape)
    ray = forward + offset * np.tan(np.radians(camera.field) / 2)
    return np.broadcast_to(eye, ray.shape), ray / np.linalg.norm(ray, axis=1, keepdims=True)


__all__ = ["View", "to_local", "view"]
