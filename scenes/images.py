"""Pictures of radiance in files: OpenEXR and Radiance HDR, by OpenImageIO (an optional dependency)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..files import StrPath, reading, replacing

Reals = NDArray[np.float64]


def _library(path: StrPath) -> Any:
    try:
        import OpenImageIO
    except ImportError:
        raise InputError(f"{path}: images of radiance need OpenImageIO: pip install 'brdfit[scenes]'") from None
    return OpenImageIO


def read_image(path: StrPath) -> Reals:
    """Radiance ``[rows, columns, 3]`` in an .exr or .hdr file; grey images are repeated, alpha is left out.

    Raises InputError if it cannot be read, is not at least 2 x 2, or holds values that are negative or not finite.
    """
    with reading(path):  # the usual faults of a path, in the usual words
        pass
    library = _library(path)
    file = library.ImageInput.open(str(path))
    if file is None:
        raise InputError(f"{path}: is not an image that can be read ({' '.join(library.geterror().split())})")
    pixels = file.read_image("float")
    file.close()
    if pixels is None:
        raise InputError(f"{path}: its pixels cannot be read; copy it again")
    image = np.asarray(pixels, float)
    image = image[..., :3] if image.shape[-1] >= 3 else np.repeat(image[..., :1], 3, -1)
    if min(image.shape[:2]) < 2:
        raise InputError(f"{path}: has {image.shape[1]} x {image.shape[0]} pixels; an environment needs 2 x 2")
    if not np.isfinite(image).all() or image.min() < 0:
        raise InputError(f"{path}: has radiance that is negative or not finite; correct the image")
    if not image.max() > 0:
        raise InputError(f"{path}: is black everywhere; leave the light out")
    return image


def write_exr(path: StrPath, layers: dict[str, Reals]) -> None:
    """Pictures ``[rows, columns, 3]`` of one size as layers of an .exr file, in half precision.

    Raises InputError if it cannot be written.
    """
    library = _library(path)
    pixels = np.concatenate([np.asarray(a, np.float32) for a in layers.values()], -1)
    with replacing(path) as temporary:
        spec = library.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], "half")
        spec.channelnames = tuple(f"{name}.{c}" for name in layers for c in "RGB")
        out = library.ImageOutput.create(str(temporary))
        written = out and out.open(str(temporary), spec) and out.write_image(np.ascontiguousarray(pixels)) and out.close()
        if not written:
            raise InputError(f"{path}: cannot be written ({library.geterror()}); check its directory and free space")


__all__ = ["read_image", "write_exr"]
