"""The atlas as files: Markdown with pictures, one self-contained HTML page, and JSON with all numbers."""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..environment import environment
from ..files import StrPath, replacing
from ..reports.beside import rendered
from ..reports.plots import data_uri
from .atlas import Map, Record, Worst, survey
from .measure import HELD, LARGEST_SLOPE, SMALLEST_SINGLE

TITLES = {
    "models": "Models",
    "ndf": "Normal distributions",
    "masking": "Masking",
    "fresnel": "Fresnel reflectance",
    "special": "Special functions",
}
A_PICTURE = 24
"""Maps that one picture shows."""
DIGITS = {"float64": 16, "float32": 8}


def write_atlas(out_dir: StrPath, draws: int | None = None, say: Callable[[str], None] = lambda text: None) -> Path:
    """Measure everything and write DIR/stability.md with its pictures, DIR/stability.html and DIR/stability.json."""
    records, where = survey(draws, say), environment()
    out = Path(out_dir)
    groups = []
    for key, title in TITLES.items():
        members = [r for r in records if r.group == key]
        names = [f"{key}-{k}" for k in range(1, 2 + sum(len(_maps([r])) for r in members) // A_PICTURE)]
        pictures = [_picture(part) for part in _shared_out(members, len(names))]
        names = names if len(names) > 1 else [key]
        for name, picture in zip(names, pictures, strict=True):
            _write(out / "stability" / f"{name}.png", picture)
        shown = [{"name": n, "embedded": data_uri(p)} for n, p in zip(names, pictures, strict=True)]
        groups.append({"title": title, "rows": [_row(r) for r in members], "pictures": shown})
    context = {
        "groups": groups,
        "where": where,
        "draws": draws,
        "finite": all(r.values_not_finite == r.slopes_not_finite == 0 for r in records),
        "slope_end": f"{LARGEST_SLOPE:.0e}",
        "value_floor": f"{SMALLEST_SINGLE[0]:.0e}",
        "slope_floor": f"{SMALLEST_SINGLE[1]:.0e}",
        "held": f"{HELD:.0e}",
        "beyond": [_beyond(r) for r in records if r.beyond_share],
    }
    for name in ("stability.md", "stability.html"):
        _write(out / name, rendered(Path(__file__).parent / f"{name}.j2", context).encode())
    document = {
        "format": "brdfit-stability",
        "version": 1,
        "environment": where,
        "records": [asdict(r) for r in records],
    }
    _write(out / "stability.json", (json.dumps(document, indent=1, allow_nan=False, default=_rounded) + "\n").encode())
    return out / "stability.html"


def _maps(records: Sequence[Record]) -> list[tuple[Record, Map]]:
    return [(r, m) for r in records if r.precision == "float64" for m in r.maps]


def _shared_out(records: Sequence[Record], count: int) -> list[list[Record]]:
    """The records in order, in ``count`` pictures of about as many maps."""
    total = len(_maps(records))
    out: list[list[Record]] = [[] for _ in range(count)]
    names = list(dict.fromkeys(r.name for r in records))
    seen = 0
    for name in names:
        mine = [r for r in records if r.name == name]
        out[min(seen * count // max(total, 1), count - 1)] += mine
        seen += len(_maps(mine))
    return out


def _where(found: Worst) -> str:
    at = ", ".join(f"{k} {v:.6g}" for k, v in found.at.items() if not k.startswith(("wi_", "wo_")))
    return at or "directions only"


def _beyond(r: Record) -> dict[str, Any]:
    return {
        "name": r.name,
        "group": TITLES[r.group].lower(),
        "share": f"{100 * r.beyond_share:.2g} %",
        "error": f"{r.beyond.error:.1e}",
        "by": r.beyond.argument,
        "moved": f"{r.beyond_moved:.1e}",
        "at": _where(r.beyond),
    }


def _row(r: Record) -> dict[str, Any]:
    return {
        "name": r.name,
        "precision": r.precision,
        "value": f"{r.value.error:.1e}",
        "at": _where(r.value),
        "slope": f"{r.slope.error:.1e}",
        "by": r.slope.argument,
        "slope_at": _where(r.slope),
        "points": r.points,
        "draws": r.draws,
        "bad": f"{r.values_not_finite} / {r.slopes_not_finite}",
    }


def _rounded(a: NDArray[np.float64]) -> list[Any]:
    """Rows of an array, numbers of six digits."""
    return [float(f"{v:.6g}") for v in a] if a.ndim == 1 else list(a)


def _picture(records: Sequence[Record]) -> bytes:
    """Digits kept, a row for each part and varied argument, a column for each of value and slope in either precision."""
    from matplotlib import rc_context
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    pairs = _maps(records)
    single = {(r.name, m.varied): m for r in records for m in r.maps if r.precision == "float32"}
    with rc_context({"font.size": 6, "axes.linewidth": 0.4, "xtick.major.width": 0.3, "ytick.major.width": 0.3}):
        figure = Figure(figsize=(8.2, 0.35 + 0.95 * len(pairs)), layout="constrained")
        FigureCanvasAgg(figure)
        axes = figure.subplots(max(len(pairs), 1), 4, squeeze=False)  # the V-cavity alone has no map
        for row, (line, (record, m)) in enumerate(zip(axes, pairs, strict=False)):
            other = single[record.name, m.varied]
            panels = ((m.value, "float64"), (m.slope, "float64"), (other.value, "float32"), (other.slope, "float32"))
            for k, (ax, (error, precision)) in enumerate(zip(line, panels, strict=True)):
                digits = np.clip(-np.log10(np.maximum(error, 1e-18)), 0, DIGITS[precision])
                shown = ax.imshow(digits, cmap="viridis", vmin=0, vmax=DIGITS[precision], aspect="auto")
                _label(ax, record, m, first=k == 0)
                if row == 0:
                    ax.set_title(f"{('value', 'slope')[k % 2]}, {precision}: digits")
                if k % 2:
                    figure.colorbar(shown, ax=ax, pad=0.02, aspect=12)
        out = io.BytesIO()
        figure.savefig(out, format="png", dpi=100, metadata={"Software": None}, pil_kwargs={"optimize": True})
    return out.getvalue()


def _label(ax: Any, record: Record, m: Map, first: bool) -> None:
    in_degrees = record.angle not in ("p", "any")
    columns = np.degrees(m.columns) if in_degrees else m.columns
    places = range(0, len(columns), max(1, len(columns) // 4))
    ax.set_xticks(list(places), [f"{columns[k]:.5g}" for k in places])
    if record.angle == "any":
        ax.set_xticks([])
    else:
        ax.set_xlabel(record.angle + (", degrees" if in_degrees else ""), labelpad=1)
    rows = range(0, len(m.rows), max(1, len(m.rows) // 3))
    ax.set_yticks(list(rows), [f"{m.rows[k]:.2g}" for k in rows] if first else [])
    if first:
        name = record.name.replace("Anisotropic", "\nAnisotropic").replace("_anisotropic", "\nanisotropic")
        ax.set_ylabel(f"{name}\n{m.varied}", fontsize=6)


def _write(path: Path, content: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as temporary:
        temporary.write_bytes(content)


__all__ = ["write_atlas"]
