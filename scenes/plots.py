"""The figures of a scene's page: pictures and difference maps as PNG, the ladder and the scene map as SVG or PNG."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..colours import encode, screen
from ..reports.plots import as_svg, data_uri, log_ticks, new_figure, png_uri, styled
from ..tables import HalfDifferenceGrid
from .choose import Tried
from .pixels import View
from .scene import MEASURES, Reals, Tolerance

GREY = 0.93
"""What is beside the object, on the page."""


def picture(view: View, values: Reals, exposure: float) -> str:
    """The picture ``[P, C]`` in sRGB, as a PNG for a page."""
    return _png(view.picture(encode(screen(values, exposure)), GREY))


def difference_map(view: View, values: Reals, top: float) -> str:
    """Values ``[P]`` from 0 (light) to ``top`` (dark), as a PNG for a page."""
    from matplotlib import colormaps

    coloured = colormaps["magma_r"](np.clip(values / top, 0, 1))[:, :3]
    return _png(view.picture(np.asarray(coloured), GREY))


def scale() -> str:
    """The colours of :func:`difference_map`, as a PNG for a page."""
    from matplotlib import colormaps

    return _png(np.broadcast_to(colormaps["magma_r"](np.linspace(0, 1, 256))[None, :, :3], (12, 256, 3)))


def ladder(rungs: Sequence[Tried], everything: Tried, tolerance: Tolerance, alt: str) -> str:
    """Image error over the time of one evaluation, effect after effect. SVG text."""
    with styled("scene-ladder"):
        figure, axes = new_figure(7.4, 3.6, (0.7, 0.2, 0.5, 0.15))
        ax = axes[0, 0]
        ax.set_yscale("log" if tolerance.measure != "psnr" else "linear")
        ax.set_xscale("log")
        if everything not in rungs:
            point = everything.nanoseconds, everything.error
            ax.plot(*point, "o", ms=4, mfc="white", mec="#999999", mew=0.8)
            ax.annotate("everything", point, xytext=(6, 5), textcoords="offset points", color="#666666")
        x, y = [t.nanoseconds for t in rungs], [t.error for t in rungs]
        ax.plot(x, y, "-o", color="#0072B2", ms=5.5, lw=1)
        before: set[str] = set()
        for k, t in enumerate(rungs):
            new = [n for n in t.effects if n not in before]
            text = " + ".join(new) if not before else "+ " + ", ".join(new)
            before = set(t.effects)
            ax.annotate(text.replace("_", " "), (t.nanoseconds, t.error), xytext=(7, -12 if k % 2 else 5),
                        textcoords="offset points")  # fmt: skip
        last = rungs[-1]
        ax.plot(last.nanoseconds, last.error, "o", ms=10, mfc="none", mec="#0072B2")
        ax.axhline(tolerance.limit, color="#555555", lw=0.8, ls=(0, (2, 2)))
        ax.annotate("tolerance", (1, tolerance.limit), xycoords=("axes fraction", "data"), xytext=(-2, 3),
                    textcoords="offset points", ha="right", color="#555555")  # fmt: skip
        log_ticks(ax)
        low, high = ax.get_xlim()
        ax.set_xlim(low, high * 1.6)
        ax.set_xlabel("float32, nanoseconds a direction")
        ax.set_ylabel(MEASURES[tolerance.measure][1])
        return as_svg(figure, alt)


def scene_map(cells: Reals, grid: HalfDifferenceGrid, alt: str) -> str:
    """Density of what the picture shows over (theta_h, theta_d), summed over phi_d: a PNG for a page."""
    with styled("scene-map", grid=False):
        figure, axes = new_figure(7.4, 3.6, (0.7, 0.2, 0.5, 0.15))
        ax = axes[0, 0]
        rows, columns = _coarser(grid.theta_h_edges, 45), _coarser(grid.theta_d_edges, 45)
        weight = np.add.reduceat(np.add.reduceat(cells.sum(2), rows[:-1], 0), columns[:-1], 1)
        h, d = np.degrees(grid.theta_h_edges[rows]), np.degrees(grid.theta_d_edges[columns])
        density = weight / np.outer(np.diff(np.sqrt(h)), np.diff(d))
        top = density.max()
        shown = np.ma.masked_less(density, top * 1e-4)
        from matplotlib.colors import LogNorm

        mesh = ax.pcolormesh(d, np.sqrt(h), shown, cmap="viridis_r", norm=LogNorm(top * 1e-4, top), rasterized=True)
        marks = np.array([0, 1, 5, 10, 20, 30, 45, 60, 90])
        ax.set_yticks(np.sqrt(marks), [f"{m}" for m in marks])
        ax.set_xticks([0, 15, 30, 45, 60, 75, 90])
        ax.set_xlabel("θ$_d$, degrees: from facing the light to grazing")
        ax.set_ylabel("θ$_h$, degrees: off the mirror direction")
        bar = figure.colorbar(mesh, ax=ax, pad=0.015, aspect=30)
        bar.set_ticks([top * 1e-4, top * 1e-2, top], labels=["10$^{-4}$", "10$^{-2}$", "most"])
        out = io.BytesIO()
        figure.savefig(out, format="png", dpi=180)
    return f'<img src="{data_uri(out.getvalue())}" alt="{alt}">'


def _coarser(edges: Reals, most: int) -> Any:
    n = len(edges) - 1
    return np.append(np.arange(0, n, -(-n // most)), n)


def _png(colours: Reals) -> str:
    return png_uri((np.clip(colours, 0, 1) * 255 + 0.5).astype(np.uint8))


__all__ = ["difference_map", "ladder", "picture", "scale", "scene_map"]
