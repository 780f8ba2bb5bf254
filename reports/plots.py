"""The figures of a report: line plots as SVG text, images as PNG. The same arrays give the same bytes."""

from __future__ import annotations

import base64
import io
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..colours import encode, luminance, screen
from .evidence import Albedo, Lobes, Maps, Sphere

PALETTE = {
    "gtr": "#0072B2",
    "abc": "#D55E00",
    "sgd": "#009E73",
    "ward": "#CC79A7",
    "ashikhmin_shirley": "#E69F00",
    "lambert": "#7F7F7F",
}
"""Okabe and Ito's colours, which colour-blind readers can tell apart."""

OTHERS = ("#56B4E9", "#8C564B", "#5D3A9B", "#A6A600", "#0072B2", "#D55E00", "#009E73", "#CC79A7")
DASHES: tuple[Any, ...] = ("-", (0, (5, 1.5)), (0, (1.5, 1.2)), (0, (6, 1.5, 1.2, 1.5)), (0, (9, 2)))
MARKERS = "osD^vP*X"
RGB = ("#B2182B", "#1B7837", "#2166AC")

_STYLE: dict[Any, Any] = {
    "font.size": 8.5,
    "font.family": "sans-serif",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.6,
    "axes.edgecolor": "#555555",
    "axes.titlesize": 9,
    "axes.grid": True,
    "grid.color": "#e3e3e3",
    "grid.linewidth": 0.5,
    "xtick.color": "#333333",
    "ytick.color": "#333333",
    "xtick.major.width": 0.5,
    "ytick.major.width": 0.5,
    "lines.linewidth": 1.3,
    "legend.frameon": False,
    "svg.fonttype": "none",
    "mathtext.default": "regular",
}


_PRINTING: dict[str, Any] = {
    "precision": 8,
    "threshold": 1000,
    "edgeitems": 3,
    "linewidth": 75,
    "suppress": False,
    "nanstr": "nan",
    "infstr": "inf",
    "sign": "-",
    "formatter": None,
    "floatmode": "maxprec",
    "legacy": False,
}
"""NumPy's own defaults."""


def styles(names: Sequence[str]) -> dict[str, dict[str, Any]]:
    """Colour, dash and marker for each label; those of the five models are always the same."""
    known = list(PALETTE)
    out: dict[str, dict[str, Any]] = {}
    spare = 0
    for n in names:
        if n in PALETTE:
            k, colour = known.index(n), PALETTE[n]
        else:
            k, colour = spare + 1, OTHERS[spare % len(OTHERS)]
            spare += 1
        out[n] = {"color": colour, "linestyle": DASHES[k % len(DASHES)], "marker": MARKERS[k % len(MARKERS)]}
    return out


def new_figure(
    width: float, height: float, margins: tuple[float, float, float, float], rows: int = 1, columns: int = 1, **options: Any
) -> tuple[Any, NDArray[Any]]:
    """A figure of ``width`` x ``height`` inches with axes inside ``margins`` (left, right, bottom, top), in inches."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height))
    FigureCanvasAgg(figure)
    left, right, bottom, top = margins
    figure.subplots_adjust(left / width, bottom / height, 1 - right / width, 1 - top / height)
    return figure, figure.subplots(rows, columns, squeeze=False, **options)


@contextmanager
def styled(salt: str = "", grid: bool = True) -> Iterator[None]:
    """The style of all figures. The ids in an SVG are hashes of printed numbers, so it settles how numbers print, too."""
    import matplotlib

    style: dict[Any, Any] = {**_STYLE, "svg.hashsalt": salt, "axes.grid": grid}
    with matplotlib.rc_context(style), np.printoptions(**_PRINTING):
        yield


def as_svg(figure: Any, alt: str) -> str:
    """The figure as an inline SVG element with a text alternative, without ids that could clash in a page."""
    out = io.StringIO()
    figure.savefig(out, format="svg", metadata={"Date": None})
    text = out.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.S)
    text = re.sub(r' id="[A-Za-z0-9.]+_\d+"', "", text)
    text = re.sub(r"<!--.*?-->", "", text, flags=re.S)
    text = re.sub(r' d="[^"]+"', lambda m: re.sub(r"(\.\d\d)\d+", r"\1", m.group(0)), text)
    size = re.search(r'viewBox="0 0 ([\d.]+) ([\d.]+)"', text)
    box = size.group(0) if size else ""
    head = f'<svg {box} role="img" aria-label="{alt}" xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink">'
    return head + f"<title>{alt}</title>" + text[text.index(">") + 1 :].strip()


def log_ticks(ax: Any) -> None:
    """Plain numbers at more than the powers of ten where logarithmic axes are short."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    for axis, (low, high) in ((ax.xaxis, ax.get_xlim()), (ax.yaxis, ax.get_ylim())):
        if axis.get_scale() == "log" and (decades := np.log10(high / low)) < 2.5:
            axis.set_major_locator(LogLocator(subs=(1, 2, 5) if decades > 0.8 else tuple(range(1, 10))))
            axis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}"))
            axis.set_minor_formatter(NullFormatter())


def png_uri(picture: NDArray[np.uint8]) -> str:
    """The data URI of a picture ``[height, width, 3]`` as PNG."""
    from PIL import Image

    out = io.BytesIO()
    Image.fromarray(picture).save(out, "PNG", optimize=True)
    return data_uri(out.getvalue())


def data_uri(png: bytes) -> str:
    """The data URI of a PNG."""
    return "data:image/png;base64," + base64.b64encode(png).decode()


def lobes(part: Lobes, fits: Sequence[tuple[int, str]], alt: str, salt: str) -> str:
    """Luminance in the plane of incidence: all on a log scale, the peak on a linear one. ``fits``: (row, label)."""
    from matplotlib.ticker import NullLocator

    style = styles([label for _, label in fits])
    columns = len(part.theta_i)
    with styled(salt):
        figure, axes = new_figure(10, 4.9, (0.6, 0.05, 0.45, 0.6), 2, columns)
        figure.subplots_adjust(wspace=0.2, hspace=0.22)
        measured = luminance(part.measured)
        fitted = luminance(part.fitted)
        floor = _floor(measured)
        for k, angle in enumerate(part.theta_i):
            x = part.theta_o[k]
            zoom = _window(x, measured[k], angle)
            for row, ax in enumerate(axes[:, k]):
                ax.plot(x, measured[k], color="#222222", lw=3.2, alpha=0.28, solid_capstyle="round", label="measured")
                for m, label in fits:
                    s = style[label]
                    ax.plot(x, fitted[m, k], color=s["color"], linestyle=s["linestyle"], label=label, lw=1.2)
                ax.axvline(angle, color="#999999", lw=0.5, zorder=0)
                if row == 0:
                    ax.set_yscale("log")
                    ax.yaxis.set_minor_locator(NullLocator())
                    ax.set_title(f"light at {angle:.3g}°")
                    ax.set_xlim(-90, 90)
                    ax.set_xticks([-60, -30, 0, 30, 60])
                else:
                    ax.set_xlim(*zoom)
                    ax.set_xlabel("viewer θ$_o$, degrees")
        top = np.nanmax(np.where(np.isfinite(measured), measured, np.nan), initial=floor)
        for k in range(columns):
            axes[0, k].set_ylim(floor, 5 * top)
            if k:
                axes[0, k].tick_params(labelleft=False)
            peak = np.nanmax(measured[k], initial=0.0)
            highest = np.nanmax(fitted[[m for m, _ in fits], k], initial=peak)
            axes[1, k].set_ylim(0, 1.08 * min(highest, 3 * peak) if peak > 0 else None)
        axes[0, 0].set_ylabel("BRDF, 1/sr (log)")
        axes[1, 0].set_ylabel("BRDF near the peak, 1/sr")
        handles, labels = axes[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="upper center", ncols=min(len(labels), 8), handlelength=3)
        return as_svg(figure, alt)


def channels(part: Lobes, row: int, names: Sequence[str], alt: str, salt: str) -> str:
    """Each channel of one fit in the plane of incidence, log scale."""
    from matplotlib.ticker import NullLocator

    columns = len(part.theta_i)
    count = part.measured.shape[-1]
    colours = RGB if count == 3 else [f"C{c % 10}" for c in range(count)]
    with styled(salt):
        figure, axes = new_figure(10, 2.7, (0.6, 0.05, 0.45, 0.3), 1, columns, sharey="row")
        figure.subplots_adjust(wspace=0.08)
        for k, angle in enumerate(part.theta_i):
            ax = axes[0, k]
            for c in range(count):
                ax.plot(part.theta_o[k], part.measured[k, :, c], color=colours[c], lw=3.0, alpha=0.28)
                ax.plot(part.theta_o[k], part.fitted[row, k, :, c], color=colours[c], lw=1.0, label=names[c])
            ax.set_yscale("log")
            ax.yaxis.set_minor_locator(NullLocator())
            ax.set_xlim(-90, 90)
            ax.set_xticks([-60, -30, 0, 30, 60])
            ax.set_title(f"light at {angle:.3g}°")
            ax.set_xlabel("viewer θ$_o$, degrees")
        floor = _floor(part.measured)
        axes[0, 0].set_ylim(floor, 3 * np.nanmax(np.where(np.isfinite(part.measured), part.measured, np.nan), initial=floor))
        axes[0, 0].set_ylabel("BRDF, 1/sr (log)")
        if count <= 8:
            axes[0, 0].legend(loc="upper left", handlelength=1.2, ncols=1 if count <= 4 else 2)
        return as_svg(figure, alt)


def _floor(values: NDArray[Any]) -> float:
    """Lower end of a log axis: below nearly all measured values."""
    positive = values[np.isfinite(values) & (values > 0)]
    return float(np.percentile(positive, 0.5)) / 3 if len(positive) else 1e-4


def _window(x: NDArray[Any], y: NDArray[Any], angle: float) -> tuple[float, float]:
    """Where the peak is on a linear axis: four times the width at half height, at least 1 degree to either side."""
    near = np.isfinite(y) & (np.abs(x - angle) < 45)
    if not near.any():
        return -90.0, 90.0
    high = x[near & (y > 0.5 * y[near].max())]
    reach = min(max(2.5 * float(np.ptp(high)), 1.0), 60.0)
    return max(angle - reach, -90.0), min(angle + reach, 90.0)


def maps(part: Maps, fits: Sequence[tuple[int, str]]) -> str:
    """Signed and RMS residual of each fit over (theta_h, theta_d), as the data URI of a PNG."""
    from matplotlib import colormaps

    rows = [m for m, _ in fits]
    known = np.isfinite(part.signed[rows])
    limit = float(np.percentile(np.abs(part.signed[rows][known]), 98)) if known.any() else 1.0
    top = float(np.percentile(part.rms[rows][known], 98)) if known.any() else 1.0
    limit, top = max(limit, 1e-6), max(top, 1e-6)
    with styled(grid=False):
        columns = len(rows)
        width = 1.72 * columns + 1.5
        figure, axes = new_figure(width, 4.0, (0.55, 0.95, 0.45, 0.3), 2, columns, sharex=True, sharey=True)
        figure.subplots_adjust(wspace=0.1, hspace=0.12)
        ticks = np.array([0, 1, 5, 20, 45, 90])
        for k, (m, label) in enumerate(fits):
            for ax, data, name, low, high in (
                (axes[0, k], part.signed[m], "RdBu_r", -limit, limit),
                (axes[1, k], part.rms[m], "viridis", 0.0, top),
            ):
                cmap = colormaps[name].with_extremes(bad="#d8d8d8")
                image = ax.pcolormesh(
                    part.theta_d, np.sqrt(part.theta_h), np.ma.masked_invalid(data), cmap=cmap, vmin=low, vmax=high
                )
                ax.set_facecolor("#d8d8d8")
                ax.set_yticks(np.sqrt(ticks), [str(t) for t in ticks])
                ax.set_xticks([0, 30, 60, 90])
                if k == columns - 1:
                    box = ax.get_position()
                    place = figure.add_axes((1 - 0.85 / width, box.y0, 0.13 / width, box.height))
                    bar = figure.colorbar(image, cax=place)
                    bar.set_label("mean residual" if ax is axes[0, k] else "RMS residual")
                    bar.outline.set_linewidth(0.4)
            axes[0, k].set_title(label)
            axes[1, k].set_xlabel("θ$_d$, degrees")
        for ax in axes[:, 0]:
            ax.set_ylabel("θ$_h$, degrees")
        out = io.BytesIO()
        figure.savefig(out, format="png", dpi=150, metadata={"Software": None})
    return data_uri(_quantised(out.getvalue()))


def _quantised(png: bytes) -> bytes:
    """The same picture with 256 colours, at a third of the size."""
    from PIL import Image

    out = io.BytesIO()
    Image.open(io.BytesIO(png)).convert("RGB").quantize(256, dither=Image.Dither.NONE).save(out, "PNG", optimize=True)
    return out.getvalue()


def sphere(part: Sphere, values: NDArray[Any]) -> str:
    """A sphere under the common exposure, data URI. Grey stripes: no measured value. Black: the sphere's own shade."""
    known = np.isfinite(values).all(-1)
    code = np.where(known[:, None], encode(np.nan_to_num(screen(values, part.exposure))), 0.0)
    return _image(part, code, known)


def difference(part: Sphere, row: int, top: float) -> str:
    """The CIEDE2000 difference of one fit, from 0 (dark) to ``top`` and beyond (light), data URI."""
    from matplotlib import colormaps

    values = part.difference[row]
    known = np.isfinite(values)
    return _image(part, colormaps["inferno"](np.clip(np.nan_to_num(values) / top, 0, 1))[:, :3], known)


def scale(top: float) -> str:
    """A colour bar for :func:`difference`, data URI."""
    from matplotlib import colormaps

    row = colormaps["inferno"](np.linspace(0, 1, 128))[None, :, :3].repeat(8, 0)
    return png_uri(np.round(255 * row).astype(np.uint8))


def _image(part: Sphere, code: NDArray[Any], known: NDArray[Any]) -> str:
    n = part.lit.shape[0]
    picture = np.full((n, n, 3), 255, np.uint8)
    picture[part.lit == 2] = 24
    y, x = np.nonzero(part.lit == 1)
    stripes = np.where(((x + y) // 3 % 2)[:, None], 150, 185)
    picture[y, x] = np.where(known[:, None], np.round(255 * code), stripes).astype(np.uint8)
    return png_uri(picture)


def albedo(part: Albedo, fits: Sequence[tuple[int, str]], max_angle: float, alt: str, salt: str) -> str:
    """Directional albedo, the mean of the channels, over the angle of incidence; the measured one up to ``max_angle``."""
    style = styles([label for _, label in fits])
    with styled(salt):
        figure, axes = new_figure(5.2, 3.0, (0.55, 1.75, 0.45, 0.1))
        ax = axes[0, 0]
        enough = (part.covered > 0.98) & (part.theta_i <= max_angle + 1e-6)
        if enough.any():
            ax.plot(
                part.theta_i[enough], part.measured[enough].mean(-1), color="#222222", lw=3.2, alpha=0.28, label="measured"
            )
        for m, label in fits:
            s = style[label]
            ax.plot(
                part.theta_i,
                part.fitted[m].mean(-1),
                color=s["color"],
                linestyle=s["linestyle"],
                marker=s["marker"],
                ms=3,
                lw=1.2,
                label=label,
            )
        top = float(np.nanmax(part.fitted[[m for m, _ in fits]].mean(-1), initial=0.1))
        if top > 0.6:
            ax.axhline(1, color="#000000", lw=0.8)
        ax.set_ylim(0, min(max(1.08 * top, 0.02), 3.0))
        ax.set_xlim(0, 90)
        ax.set_xticks([0, 15, 30, 45, 60, 75, 90])
        ax.set_xlabel("light θ$_i$, degrees")
        ax.set_ylabel("albedo")
        figure.legend(loc="upper right", handlelength=2.2)
        return as_svg(figure, alt)


def tradeoff(points: Sequence[tuple[str, float, float]], limit: float | None, alt: str, salt: str) -> str:
    """Error over the time of the solve, with a line at ``limit``; ``points`` are (label, seconds, error)."""
    style = styles([p[0] for p in points])
    with styled(salt):
        figure, axes = new_figure(5.2, 3.0, (0.6, 0.1, 0.45, 0.1))
        ax = axes[0, 0]
        ax.set_xscale("log")
        ax.set_yscale("log")
        for label, time, error in points:
            ax.plot(time, error, marker=style[label]["marker"], color=style[label]["color"], ms=6, lw=0)
            crowded = any(1 < t / time < 2.2 and 0.7 < e / error < 1.43 for n, t, e in points if n != label)
            side, shift = ("right", -6) if crowded else ("left", 6)
            ax.annotate(label, (time, error), xytext=(shift, 3), textcoords="offset points", ha=side, color="#222222")
        times, errors = np.array([p[1] for p in points]), np.array([p[2] for p in points])
        ax.set_xlim(times.min() / 4, times.max() * 3.2)
        shown = errors if limit is None else np.append(errors, limit)
        ax.set_ylim(shown.min() / 1.5, shown.max() * 1.6)
        if limit is not None:
            ax.axhline(limit, color="#555555", lw=0.8, ls=(0, (2, 2)))
        log_ticks(ax)
        ax.set_xlabel("solve, seconds")
        ax.set_ylabel("perceptual error")
        return as_svg(figure, alt)
