"""How different two pictures of an object look, over its pixels.

Pictures are linear radiance ``[P, C]``; times the exposure, 1 is white. Three channels are linear sRGB, any other number
is shown as grey.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..colours import delta_e, encode, library, luminance, screen
from .pixels import View
from .scene import Reals

WHITE = 100.0
"""Luminance of white on the screen, cd/m^2: a surface of mean 0.8 is shown at 80."""
SIGMA, REACH, K1, K2 = 1.5, 5, 0.01, 0.03
"""Window and constants of SSIM (Wang et al. 2004, section III.B and C)."""


def difference(measure: str, a: Reals, b: Reals, exposure: float, view: View) -> float:
    """Difference of picture ``a`` from the reference ``b`` under a measure of :data:`brdfit.scenes.scene.MEASURES`.

    ``itp``: root of the mean square of ΔE ITP. ``ciede2000``: mean. ``psnr``: of the sRGB pictures, all channels, decibels.
    ``ssim``: 1 - mean SSIM of the luma of the sRGB pictures, background black. ``relative``: RMS of the difference of
    radiance over the RMS of the reference.
    """
    if measure == "itp":
        return float(np.sqrt((delta_itp(a, b, exposure) ** 2).mean()))
    if measure == "relative":
        return float(np.sqrt(((a - b) ** 2).mean() / (b**2).mean()))
    shown = screen(a, exposure), screen(b, exposure)
    if measure == "ciede2000":
        return float(delta_e(*shown).mean())
    coded = [encode(s) for s in shown]
    if measure == "psnr":
        return float(-10 * np.log10(max(((coded[0] - coded[1]) ** 2).mean(), 1e-30)))
    if measure == "ssim":
        luma = [view.picture(luminance(c)[:, None])[..., 0] for c in coded]
        return float(1 - ssim(*luma)[view.object].mean())
    raise ValueError(f"unknown measure {measure!r}")


def delta_itp(a: Reals, b: Reals, exposure: float) -> Reals:
    """ΔE ITP of each pixel, ``[P]`` (Recommendation ITU-R BT.2124-0): 1 is just noticeable at best.

    Luminance is absolute, white is :data:`WHITE`, and brighter than white is not cut off.
    """
    colour = library()
    itp = []
    for values in (a, b):
        rgb = np.maximum(values * exposure * WHITE, 0)
        rgb = rgb if rgb.shape[-1] == 3 else np.repeat(rgb.mean(-1, keepdims=True), 3, -1)
        wide = colour.RGB_to_RGB(rgb, "sRGB", "ITU-R BT.2020")
        itp.append(colour.RGB_to_ICtCp(np.maximum(wide, 0), method="ITU-R BT.2100-2 PQ"))
    return np.asarray(colour.difference.delta_E_ITP(*itp))


def ssim(a: Reals, b: Reals) -> Reals:
    """Structural similarity of two grey pictures in [0, 1] at each pixel (Wang et al. 2004, eq. 13)."""
    mean_a, mean_b = _blur(a), _blur(b)
    var_a, var_b, cov = _blur(a * a) - mean_a**2, _blur(b * b) - mean_b**2, _blur(a * b) - mean_a * mean_b
    c1, c2 = K1**2, K2**2
    return np.asarray((2 * mean_a * mean_b + c1) * (2 * cov + c2) / ((mean_a**2 + mean_b**2 + c1) * (var_a + var_b + c2)))


def _blur(image: Reals) -> Reals:
    """Mean under a Gaussian window of 11 pixels; beyond the border is black."""
    x = np.arange(-REACH, REACH + 1)
    window: NDArray[np.float64] = np.exp(-(x**2) / (2 * SIGMA**2))
    window /= window.sum()
    for axis in (0, 1):
        padded = np.pad(image, [(REACH, REACH) if k == axis else (0, 0) for k in (0, 1)])
        image = sum(w * np.take(padded, np.arange(image.shape[axis]) + k, axis) for k, w in enumerate(window))
    return image


__all__ = ["WHITE", "delta_itp", "difference", "ssim"]
