"""A study as files: scene.json with all figures, scene.html for a reader, and the pictures as scene.exr on request."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..angles import half_difference
from ..environment import environment
from ..files import StrPath, plain
from ..models import BRDF, parameter_values, parameters_of
from ..models.effects import EFFECTS
from ..reports.beside import write_beside
from ..reports.words import listed, minus, percent, seconds, significant, thousands
from .choose import Tried, Verdict
from .difference import delta_itp, difference
from .images import write_exr
from .plots import difference_map, ladder, picture, scale, scene_map
from .scene import MEASURES
from .survey import Study

PAGE, NUMBERS, PICTURES = "scene.html", "scene.json", "scene.exr"
WHY_LEFT_OUT = {
    "interreflection": "it takes five times as long as all the rest, and with a tail each step of a fit a hundred times",
    "anisotropy": "the table is isotropic",
}
TOP = 10.0
"""ΔE ITP of the darkest colour of the difference maps."""


def write_scene(out_dir: StrPath, study: Study, exr: bool = False) -> Path:
    """Write DIR/scene.json and DIR/scene.html, and DIR/scene.exr if asked, each replaced whole; returns the page's path.

    Raises InputError if a file cannot be written.
    """
    where = environment()
    template = Path(__file__).parent / "scene.html.j2"
    page = write_beside(out_dir, template, _context(study, where), (PAGE, NUMBERS), document(study, where))
    if exr:
        layers = {k: study.view.picture(p.values) for k, p in study.pictures.items()}
        layers = {k: v if v.shape[-1] == 3 else np.repeat(v.mean(-1, keepdims=True), 3, -1) for k, v in layers.items()}
        write_exr(page.parent / PICTURES, layers)
    return page


def document(study: Study, where: dict[str, Any]) -> dict[str, Any]:
    """All figures as plain JSON values; NaN becomes null."""
    scene, choice = study.scene, study.choice
    return {
        "format": "brdfit-scene",
        "version": 1,
        "environment": where,
        "scene": scene.name,
        "material": study.table.material,
        "source": study.table.source,
        "sha256": study.table.sha256,
        "angles": study.table.angles,
        "exposure": study.exposure,
        "tolerance": {"measure": scene.tolerance.measure, "limit": scene.tolerance.limit},
        "budget": scene.budget,
        "pixels": len(study.view.wo),
        "met": choice.met,
        "affordable": choice.affordable,
        "directions_a_pixel": study.lights,
        "left_out": list(study.left_out),
        "summary": summary(study),
        "chosen": _record(study, choice.chosen, "chosen"),
        "everything": _record(study, choice.everything, "everything"),
        "ladder": [_timed(t) for t in choice.ladder],
        "effects": [
            {"effect": v.effect, "called_for": v.called, "because": because(study, v), "other": v.other and _brief(v.other)}
            for v in choice.verdicts
        ],
        "tried": [{"effects": list(t.effects), "fit_error": plain(t.fit_error)} for t in choice.tried],
        "filled": study.filled,
        "noise": None
        if study.reference.noise is None
        else float(study.reference.noise.mean() / study.reference.values.mean()),
        "seconds": study.seconds,
    }


def _record(study: Study, t: Tried, key: str) -> dict[str, Any]:
    values = study.pictures[key].values
    errors = {m: plain(difference(m, values, study.reference.values, study.exposure, study.view)) for m in MEASURES}
    named = {n: v.tolist() for n, v in parameter_values(t.model).items()}
    return _timed(t) | {"errors": errors, "model": t.model.name, "parameters": named}


def _brief(t: Tried) -> dict[str, Any]:
    return {"effects": list(t.effects), "error": plain(t.error)}


def _timed(t: Tried) -> dict[str, Any]:
    work = t.operations
    return _brief(t) | {
        "nanoseconds": t.nanoseconds,
        "flops": plain(work.flops),
        "transcendentals": plain(work.transcendentals),
    }


def summary(study: Study) -> str:
    """What was found, in a few sentences."""
    choice, limit = study.choice, study.scene.tolerance
    name = MEASURES[limit.measure][1]
    times = choice.everything.nanoseconds / choice.chosen.nanoseconds
    ratio = f"{significant(times, 2)} times as fast" if times >= 1 else f"{significant(1 / times, 2)} times as slow"
    ratio = "as fast" if 0.95 < times < 1.05 else ratio
    figures = f"{name} {significant(choice.chosen.error)} (tolerance {limit.limit:g})"
    said = f"In this scene {study.table.material} shows {_names(choice.chosen)}: {figures}."
    if not choice.met:
        said = (
            f"No set of effects meets the tolerance: the best, {_names(choice.chosen)}, ends at {figures}. {missing(study)}"
        )
    said += (
        f" It takes {significant(choice.chosen.nanoseconds, 2)} ns a direction, {ratio} as {everything(study)} "
        f"({significant(choice.everything.nanoseconds, 2)} ns, {significant(choice.everything.error)})."
    )
    if not choice.affordable and study.scene.budget is not None:
        pixel = significant(study.lights * choice.chosen.nanoseconds, 2)
        said += f" With {study.lights} such a pixel, {pixel} ns, that is more than the budget of {study.scene.budget:g} ns."
    return said


def everything(study: Study) -> str:
    """What the model of everything consists of, in words."""
    used = study.choice.everything.effects
    lacking = [n for n in EFFECTS if n not in used and n not in study.left_out]
    if not lacking:
        return f"all {len(used)} effects together"
    return f"everything, {len(used)} effects without {listed(_plain(n) for n in lacking)}"


def missing(study: Study) -> str:
    """Where the chosen model falls short, in words."""
    off = delta_itp(study.pictures["chosen"].values, study.reference.values, study.exposure)
    light = study.seen
    if not len(light.weight):
        return ""
    # of the pixels the worst tenth, by the angles that the light of them comes from
    at = np.argsort(off)[-max(len(off) // 10, 1) :]
    share = (off[at] ** 2).sum() / max((off**2).sum(), 1e-30)
    n = study.view.wo[at, 2]
    grazing = float(np.degrees(np.arccos(np.clip(np.median(n), 0, 1))))
    chosen, table = (study.pictures[k].values[at].mean() for k in ("chosen", "table"))
    way = "too dark" if chosen < table else "too bright"
    return (
        f"A tenth of the pixels holds {percent(share)} of the squared difference: they are seen at about "
        f"{grazing:.0f}° from the normal and are {way} by {percent(abs(chosen / table - 1))}."
    )


def because(study: Study, v: Verdict) -> str:
    """Why a scene calls for an effect or does not, with figures."""
    chosen, other = study.choice.chosen, v.other
    here = significant(chosen.error)
    if other is None:
        return "no model is left without it" if v.called else _untried(study, v.effect)
    there = significant(other.error)
    if v.called:
        gone = [n for n in chosen.effects if n not in other.effects and n != v.effect]
        so = f" (nor {listed(_plain(n) for n in gone)}, which need{'s' if len(gone) == 1 else ''} it)" if gone else ""
        return f"without it{so} the error is {there}, not {here}"
    return f"with it the error {f'stays at {here}' if here == there else f'is {there}, not {here}'}"


def _untried(study: Study, effect: str) -> str:
    lacking = [need for need in EFFECTS[effect].needs if not set(need.split(" or ")) & set(study.choice.chosen.effects)]
    if lacking:
        return f"it needs {listed(_plain(n) for n in lacking)}, which the scene does not call for"
    return "the tolerance is met without it"


def _plain(name: str) -> str:
    return name.replace("_", " ")


def _names(t: Tried) -> str:
    return listed(_plain(n) for n in t.effects)


def _context(study: Study, where: dict[str, Any]) -> dict[str, Any]:
    scene, choice, view = study.scene, study.choice, study.view
    limit = scene.tolerance
    models = {"chosen": choice.chosen, "everything": choice.everything}
    parts = {"table": "measured table", "chosen": _names(choice.chosen), "everything": "everything"}
    pictures = [
        {
            "title": title,
            "image": picture(view, study.pictures[key].values, study.exposure),
            "caption": f"exposure {significant(study.exposure)}"
            if key == "table"
            else f"{significant(models[key].nanoseconds, 2)} ns a direction",
        }
        for key, title in parts.items()
    ]
    differences = []
    for key in ("chosen", "everything"):
        values = study.pictures[key].values
        off = delta_itp(values, study.reference.values, study.exposure)
        figures = f"RMS {significant(np.sqrt((off**2).mean()))}, largest {significant(off.max())}"
        differences.append({"title": parts[key], "image": difference_map(view, off, TOP), "caption": figures})
    cells = study.seen.cells(study.grid)
    noise = study.reference.noise
    return {
        "material": study.table.material,
        "source": Path(study.table.source).name,
        "sha256": study.table.sha256[:12],
        "scene": scene.name,
        "where": where,
        "summary": summary(study),
        "met": choice.met,
        "measure": MEASURES[limit.measure][1],
        "limit": f"{limit.limit:g}",
        "pictures": pictures,
        "differences": differences,
        "scale": scale(),
        "top": f"{TOP:g}",
        "ladder": ladder(choice.ladder, choice.everything, limit, "Image error over the cost of the model"),
        "rungs": [_row(t, choice.ladder[k - 1].effects if k else ()) for k, t in enumerate(choice.ladder)]
        + [_row(choice.everything, None)],
        "called": [_said(study, v) for v in choice.verdicts if v.called],
        "not_called": [_said(study, v) for v in choice.verdicts if not v.called],
        "left_out": [f"{_plain(n)} ({WHY_LEFT_OUT[n]})" for n in study.left_out],
        "map": scene_map(cells, study.grid, "Where in theta_h and theta_d the picture comes from"),
        "angles": _angles(study),
        "filled": percent(study.filled) if study.filled > 5e-4 else "",
        "noise": "" if noise is None else percent(float(noise.mean() / study.reference.values.mean())),
        "parameters": _parameters(choice.chosen.model),
        "pixels": thousands(len(view.wo)),
        "size": minus(f"{scene.camera.pixels[0]} \u00d7 {scene.camera.pixels[1]}"),
        "tried": len(choice.tried),
        "seconds": seconds(study.seconds),
    }


ROUNDING = 1e-12
"""What is less of the largest scale of a part, or of 1 where a parameter is no scale, is what rounding left of 0."""


def _parameters(model: BRDF) -> list[tuple[str, str]]:
    """Names and values as they are printed; 0 for what is only rounding, where 0 is in the range."""
    values = {n: np.atleast_1d(v) for n, v in parameter_values(model).items()}
    largest = max((float(np.abs(values[p.name]).max()) for p in parameters_of(model) if p.linear), default=1.0)
    out = []
    for p in parameters_of(model):
        floor = ROUNDING * (largest if p.linear else 1.0) if 0.0 in p.valid else 0.0
        out.append((p.name, " ".join(significant(x if abs(x) > floor else 0.0, 4) for x in values[p.name])))
    return out


def _said(study: Study, v: Verdict) -> dict[str, str]:
    return {"name": _plain(v.effect), "meaning": EFFECTS[v.effect].meaning, "because": because(study, v)}


def _row(t: Tried, before: tuple[str, ...] | None) -> dict[str, str]:
    new = [_plain(n) for n in t.effects if before is not None and n not in before]
    return {
        "label": "everything" if before is None else listed(new) if not before else f"+ {listed(new)}",
        "error": significant(t.error),
        "time": significant(t.nanoseconds, 2),
        "flops": thousands(t.operations.flops),
        "transcendentals": thousands(t.operations.transcendentals),
    }


def _angles(study: Study) -> str:
    """Where nine tenths of what is seen come from, in words."""
    h, d, _, _ = half_difference(study.seen.wi, study.seen.wo)
    said = []
    for name, x in (("θh", h), ("θd", d)):
        order = np.argsort(x)
        steps = np.cumsum(study.seen.weight[order])
        low, high = (np.degrees(x[order][np.searchsorted(steps, q * steps[-1])]) for q in (0.05, 0.95))
        ends = [significant(x, 2) for x in (low, high)]
        said.append(f"{name} {f'at {ends[0]}' if ends[0] == ends[1] else f'from {ends[0]} to {ends[1]}'} degrees")
    return " and ".join(said)


__all__ = ["PAGE", "because", "document", "missing", "summary", "write_scene"]
