"""The words and tables of a report: fits and evidence in, plain values for the template out."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import physics, references
from . import plots, words
from .evidence import Evidence
from .gather import fit_key
from .model_section import anchor, model_view, physics_view
from .words import significant

if TYPE_CHECKING:
    from ..fitting.result import Fit

View = dict[str, Any]

MISSING = {
    "lobes": "lobe plots",
    "maps": "residual maps",
    "sphere": "rendered spheres",
    "albedo": "directional albedo",
}


def page(fits: Sequence[Fit], evidence: Sequence[Evidence], environment: dict[str, Any]) -> View:
    """Everything that the template shows."""
    by_source = {(e.material, e.source, e.sha256): e for e in evidence}
    groups: dict[tuple[str, str, str], list[Fit]] = {}
    for f in fits:
        groups.setdefault((f.material, f.source, f.sha256), []).append(f)
    titles = _titles(list(groups))
    sections = [_section(k, titles[k], group, by_source.get(key)) for k, (key, group) in enumerate(groups.items())]
    failed = sum(not f.converged for f in fits)
    graded = any(s["graded"] for s in sections)
    summary = f"{words.count(len(fits), 'fit')} of {words.count(len(groups), 'material')}"
    if failed:
        summary += f"; {words.count(failed, 'fit')} failed or did not converge"
    return {
        "title": titles[0] if len(sections) == 1 else words.count(len(sections), "material"),
        "summary": summary[:1].upper() + summary[1:] + ".",
        "sections": sections,
        "overview": _overview(sections) if len(sections) > 1 else None,
        "grades": [
            {"words": text, "limit": None if math.isinf(limit) else f"≤ {limit:g}", "index": k}
            for k, (limit, text) in enumerate(words.GRADES)
        ],
        "graded": graded,
        "grades_note": " ".join([words.ERROR_NOTE, *([words.GRADES_NOTE] if graded else [])]),
        "references": _references(fits, evidence),
        "environment": [(str(k), _shown(v)) for k, v in sorted(environment.items())],
    }


def perceptual(fit: Fit) -> float:
    """The error that ranks fits; NaN where there is none."""
    value = fit.errors.get("perceptual")
    return math.nan if value is None else float(value)


def labels(fits: Sequence[Fit]) -> list[str]:
    """A name for each fit of one material: the model's, with what else it takes to tell them apart."""
    names = [f.model_name for f in fits]
    for extra in ("loss", "measure", "angles"):
        if len(set(names)) == len(names):
            break
        if len({getattr(f, extra) for f in fits}) > 1:
            names = [f"{n}, {getattr(f, extra)}" for n, f in zip(names, fits, strict=True)]
    return [n if names.count(n) == 1 else f"{n} #{names[:k].count(n) + 1}" for k, n in enumerate(names)]


def _titles(tables: Sequence[tuple[str, str, str]]) -> list[str]:
    """A name for each table (material, source, SHA-256): its material, and the end of its path where others share that."""
    out = []
    for material, source, digest in tables:
        others = [(PurePath(s).parts, d) for m, s, d in tables if m == material and (s, d) != (source, digest)]
        parts = PurePath(source).parts
        # as many folders as it takes; the digest where the paths are the same
        k = next((k for k in range(1, len(parts) + 1) if all(p[-k:] != parts[-k:] for p, _ in others)), len(parts))
        where = "/".join(parts[-k:]) if parts else ""
        if any(p == parts for p, _ in others):
            where = ", ".join(w for w in (where, digest[:6]) if w)
        out.append(f"{material} ({where})" if others and where else material)
    return out


def _section(number: int, title: str, fits: list[Fit], evidence: Evidence | None) -> View:
    first = fits[0]
    names = labels(fits)
    order = sorted(range(len(fits)), key=lambda k: (not math.isfinite(perceptual(fits[k])), perceptual(fits[k]), k))
    ranked = [(fits[k], names[k]) for k in order]
    rows = {key: m for m, key in enumerate(evidence.keys)} if evidence else {}
    drawn = [(rows[fit_key(f)], label) for f, label in ranked if _shows(f, rows)]
    channel_names = _channel_names(fits, evidence)
    salt = f"brdfit-{number}-"
    reflectance = _reflectance(evidence)
    ranking = [_rank(k + 1, f, label, words.no_word(f.measure, reflectance)) for k, (f, label) in enumerate(ranked)]
    graded = any(r["grade"] is not None for r in ranking)
    return {
        "number": number,
        "material": title,
        "anchor": f"m{number}-" + (re.sub(r"[^A-Za-z0-9]+", "-", first.material).strip("-").lower() or "table"),
        "about": _about(fits),
        "headline": _headline(title, ranked, reflectance),
        "disagreement": _disagreement(evidence, drawn),
        "ranking": ranking,
        "graded": graded,
        "tradeoff": _tradeoff(ranked, words.SEEN if graded else None, salt),
        "spheres": _spheres(evidence, drawn, first.material),
        "lobes": _lobes(evidence, drawn, first.material, salt),
        "channels": _channels(evidence, ranked, rows, channel_names, salt),
        "maps": _maps(evidence, drawn, first.material),
        "albedo": _albedo(evidence, drawn, first, salt),
        "losses": _losses(*zip(*ranked, strict=True)),
        "physics": [physics_view(f, label, evidence, rows) for f, label in ranked if f.parameters],
        "models": [
            model_view(f, label, channel_names, evidence.published.get(fit_key(f)) if evidence else None)
            for f, label in ranked
        ],
        "missing": _missing(evidence, [n for f, n in ranked if f.parameters and not _shows(f, rows)]),
        "overview": {
            label: (perceptual(f), f.converged, rank["grade"]) for (f, label), rank in zip(ranked, ranking, strict=True)
        },
    }


def _shows(fit: Fit, rows: dict[str, int]) -> bool:
    return bool(fit.parameters) and fit_key(fit) in rows


def _channel_names(fits: Sequence[Fit], evidence: Evidence | None) -> tuple[str, ...]:
    if evidence and evidence.channel_names:
        return evidence.channel_names
    count = max((v.size for f in fits for v in f.parameters.values()), default=1)
    return ("R", "G", "B") if count == 3 else tuple(str(k) for k in range(count))


def _about(fits: Sequence[Fit]) -> str:
    f = fits[0]
    cells = f.cells
    used, masked, total = (cells.get(k, 0) for k in ("used", "masked", "total"))
    beyond = total - used - masked
    where = "" if f.angles == "exact" else f", angles at the cell's {f.angles}"
    settings = sorted({f"loss {f.loss}, measure {f.measure.replace('_', ' ')}{where}" for f in fits})
    file = PurePath(f.source).name + (f" (SHA-256 {f.sha256[:12]}…)" if f.sha256 else "")
    text = (f"{file}. " if file else "") + "; ".join(settings).capitalize() + ". "
    text += (
        f"{words.thousands(used)} of {words.thousands(total)} cells fitted, {words.thousands(masked)} masked as not measured"
    )
    return text + (f", {words.thousands(beyond)} measured but beyond {f.max_angle:g}°." if beyond > 0 else ".")


def _reflectance(evidence: Evidence | None) -> float:
    """Mean share of the light that a material returns, by its table or else by its fits; NaN where nothing says it."""
    if evidence is None or evidence.albedo is None:
        return math.nan
    part = evidence.albedo
    for values in (part.measured[part.covered > 0.5], part.fitted):
        if np.isfinite(values).any():
            return float(np.nanmean(values))
    return math.nan


def _headline(material: str, ranked: Sequence[tuple[Fit, str]], reflectance: float) -> str:
    good = [(f, label) for f, label in ranked if math.isfinite(perceptual(f))]
    if not good:
        if any(f.parameters for f, _ in ranked):
            return f"Fits to {material} without a perceptual error to rank them."
        return f"No model could be fitted to {material}."
    best, label = good[0]
    error = perceptual(best)
    among = f"Best of {words.number(len(ranked))}" if len(ranked) > 1 else "The one fit"
    why = words.no_word(best.measure, reflectance)
    text = f"{among} for {material}: {label}. Perceptual error {significant(error, 2)}"
    text += f" ({why})." if why else f": {words.grade(error)}."
    if not best.converged:
        text += " This fit did not converge."
    if len(good) > 1:
        second, other = good[1]
        text += f" Next is {other} with {significant(perceptual(second), 2)}"
        good_enough = [g for g in good if perceptual(g[0]) <= words.SEEN and "solve" in g[0].seconds and not why]
        if len(good_enough) > 1:
            fastest = min(good_enough, key=lambda g: g[0].seconds["solve"])
            text += (
                f"; of the {words.number(len(good_enough))} at or below {words.SEEN:g}, {fastest[1]} is the fastest to fit"
            )
            text += f" ({words.seconds(fastest[0].seconds['solve'])})"
        text += "."
    failed = [label for f, label in ranked if not f.converged and f is not best]
    if failed:
        text += f" Failed or not converged: {words.listed(failed)}."
    return text


JUST_SEEN = 1.0
"""Mean CIEDE2000 by which spheres differ that look different at all."""


def _disagreement(evidence: Evidence | None, drawn: Sequence[tuple[int, str]]) -> str:
    """What to make of a sphere that another fit than the best one comes closest to; empty where they agree."""
    if evidence is None or evidence.sphere is None or len(drawn) < 2:
        return ""
    off = {label: float(np.nanmean(d)) for m, label in drawn if np.isfinite(d := evidence.sphere.difference[m]).any()}
    first, least = drawn[0][1], min(off, key=lambda n: off[n], default="")
    if first not in off or off[first] - off[least] < JUST_SEEN:
        return ""
    return (
        f"On the sphere below {least} comes closest to the material (mean CIEDE2000 {significant(off[least], 2)}; {first} "
        f"{significant(off[first], 2)}): the ranking and its words count every pair of directions, the sphere one light. "
        "Where that is what will be seen, trust the sphere."
    )


def _rank(rank: int, f: Fit, label: str, why: str) -> View:
    error = perceptual(f)
    words_of_it = why or words.grade(error)
    if not math.isfinite(error):
        words_of_it = "perceptual error not asked for" if f.parameters else f"failed: {f.reason}"
    return {
        "rank": str(rank) if math.isfinite(error) else words.NONE,
        "label": label,
        "error": significant(error, 3),
        "grade": None if why else words.grade_index(error),
        "words": words_of_it,
        "numbers": sum(v.size for n, v in f.parameters.items() if n not in f.fixed) or words.NONE,
        "solve": words.seconds(f.seconds.get("solve", math.nan)),
        "doubt": math.isfinite(error) and not f.converged,
        "anchor": anchor(f, label),
    }


def _tradeoff(ranked: Sequence[tuple[Fit, str]], limit: float | None, salt: str) -> str | None:
    points = [
        (label, f.seconds["solve"], perceptual(f))
        for f, label in ranked
        if f.seconds.get("solve", 0) > 0 and math.isfinite(perceptual(f)) and perceptual(f) > 0
    ]
    if len(points) < 2:
        return None
    said = "; ".join(f"{label} {significant(e, 2)} in {words.seconds(t)}" for label, t, e in points)
    return plots.tradeoff(points, limit, f"Perceptual error over the seconds of the solve: {said}", salt + "cost")


def _spheres(evidence: Evidence | None, drawn: Sequence[tuple[int, str]], material: str) -> View | None:
    if evidence is None or evidence.sphere is None or not drawn:
        return None
    s = evidence.sphere
    known = int(np.isfinite(s.measured).all(-1).sum())
    worst = s.difference[[m for m, _ in drawn]]
    finite = worst[np.isfinite(worst)]
    top = max(2.0, math.ceil(float(np.percentile(finite, 98)))) if len(finite) else 2.0
    fitted = [
        {
            "label": label,
            "image": plots.sphere(s, s.fitted[m]),
            "difference": plots.difference(s, m, top) if known else None,
            "mean": significant(float(np.nanmean(s.difference[m])), 2)
            if known and np.isfinite(s.difference[m]).any()
            else words.NONE,
        }
        for m, label in drawn
    ]
    return {
        "measured": plots.sphere(s, s.measured) if known else None,
        "fitted": fitted,
        "scale": plots.scale(top),
        "top": f"{top:g}",
        "masked": words.thousands(len(s.measured) - known),
        "lit": words.thousands(len(s.measured)),
        "any_masked": known < len(s.measured),
        "grey": s.measured.shape[-1] != 3,
        "material": material,
    }


def _lobes(evidence: Evidence | None, drawn: Sequence[tuple[int, str]], material: str, salt: str) -> View | None:
    if evidence is None or evidence.lobes is None or not drawn:
        return None
    part = evidence.lobes
    at = words.listed(f"{a:.3g}°" for a in part.theta_i)
    alt = (
        f"Measured and fitted BRDF of {material} in the plane of incidence, light at {at}; above logarithmic, below the peak"
    )
    return {
        "svg": plots.lobes(part, drawn, _plain(alt), salt + "lobes"),
        "how": part.how,
        "colour": part.measured.shape[-1] == 3,
    }


def _channels(
    evidence: Evidence | None,
    ranked: Sequence[tuple[Fit, str]],
    rows: dict[str, int],
    channel_names: tuple[str, ...],
    salt: str,
) -> View | None:
    if evidence is None or evidence.lobes is None or evidence.lobes.measured.shape[-1] < 2:
        return None
    best = next(((f, label) for f, label in ranked if _shows(f, rows)), None)
    if best is None:
        return None
    alt = _plain(f"Each channel of the measured BRDF and of the fit of {best[1]} in the plane of incidence, logarithmic")
    svg = plots.channels(evidence.lobes, rows[fit_key(best[0])], channel_names, alt, salt + "channels")
    return {"svg": svg, "label": best[1]}


def _maps(evidence: Evidence | None, drawn: Sequence[tuple[int, str]], material: str) -> View | None:
    if evidence is None or evidence.maps is None or not drawn:
        return None
    signed = [(label, evidence.maps.signed[m]) for m, label in drawn]
    said = "; ".join(f"{label} mean {significant(float(np.nanmean(s)), 2)}" for label, s in signed if np.isfinite(s).any())
    alt = f"Maps of the residual of each fit of {material} over theta_h and theta_d, signed mean above and RMS below: {said}"
    return {
        "png": plots.maps(evidence.maps, drawn),
        "alt": alt,
        "how": evidence.maps.how,
        "width": 17.5 * max(len(drawn), 2) + 12,
    }


def _albedo(evidence: Evidence | None, drawn: Sequence[tuple[int, str]], first: Fit, salt: str) -> View | None:
    if evidence is None or evidence.albedo is None or not drawn:
        return None
    part = evidence.albedo
    alt = _plain(f"Directional albedo of {first.material} over the angle of incidence, measured and for each fit")
    errors = part.error[[m for m, _ in drawn]]
    worst = float(np.nanmax(errors)) if np.isfinite(errors).any() else math.nan
    return {"svg": plots.albedo(part, drawn, first.max_angle, alt, salt + "albedo"), "error": significant(worst, 1)}


def _losses(fits: Sequence[Fit], names: Sequence[str]) -> View:
    from ..fitting import LOSSES

    about = {n: LOSSES[n].meaning for n in ("perceptual", *LOSSES)}
    known = [n for n in about if any(n in f.errors for f in fits)]
    known += sorted({n for f in fits for n in f.errors} - set(about))
    table = []
    for name in known:
        values = [float(f.errors.get(name, math.nan)) for f in fits]
        finite = [v for v in values if math.isfinite(v)]
        best = min(finite) if finite else math.nan
        cells = [{"text": significant(v, 3), "best": v == best and len(finite) > 1} for v in values]
        table.append(
            {"name": name, "about": about.get(name, ""), "cells": cells, "fitted": any(f.loss == name for f in fits)}
        )
    return {"names": list(names), "rows": table}


def _missing(evidence: Evidence | None, without: Sequence[str]) -> list[str]:
    if evidence is None:
        return [
            "The evidence of this fit (evidence.h5) is not here, so its lobe plots, residual maps, spheres and directional "
            "albedo are missing. Fit again from the table to have them."
        ]
    out = []
    if without:
        out.append(
            f"the evidence kept here (evidence.h5) is not of the present fit of {words.listed(without)}, which is not drawn."
        )
    for name, title in MISSING.items():
        if name in evidence.missing:
            out.append(
                f"No {title}: {evidence.missing[name]}." if getattr(evidence, name) is None else f"{evidence.missing[name]}."
            )
    return [o[:1].upper() + o[1:] for o in out]


def _overview(sections: Sequence[View]) -> View:
    heads: list[str] = []
    for s in sections:
        heads += [n for n in s["overview"] if n not in heads]
    rows = []
    for s in sections:
        errors = {n: e for n, (e, _, _) in s["overview"].items() if math.isfinite(e)}
        best = min(errors, key=lambda n: errors[n]) if errors else None
        cells = []
        for n in heads:
            error, converged, grade = s["overview"].get(n, (math.nan, None, None))
            text = significant(error, 2) if math.isfinite(error) else ("failed" if converged is False else words.NONE)
            cells.append({"text": text, "grade": grade, "best": n == best, "doubt": converged is False})
        rows.append({"material": s["material"], "anchor": s["anchor"], "cells": cells, "best": best or "none"})
    wins = {n: sum(r["best"] == n for r in rows) for n in heads}
    best_line = ", ".join(f"{n} {c}" for n, c in sorted(wins.items(), key=lambda i: -i[1]) if c)
    doubts = any(c["doubt"] and c["text"] != "failed" for r in rows for c in r["cells"])
    return {"heads": heads, "rows": rows, "wins": best_line, "doubts": doubts}


def _references(fits: Sequence[Fit], evidence: Sequence[Evidence]) -> list[View]:
    from ..fitting import LOSSES

    uses: dict[str, list[str]] = {}

    def add(keys: Sequence[str], use: str) -> None:
        for key in keys:
            if use not in uses.setdefault(key, []):
                uses[key].append(use)

    for f in fits:
        if f.model is not None:
            add(type(f.model).references, f"model {f.model_name}")
        if f.loss in LOSSES and LOSSES[f.loss].source in references.REFERENCES:
            add((LOSSES[f.loss].source,), f"loss {f.loss}")
        if f.source.endswith(".binary"):
            add(("merl",), "data")
        if physics.normal_reflectance(f.model) is not None:
            add(("hoffman2013",), "F0 of substances")
    if any(math.isfinite(perceptual(f)) for f in fits):
        add((LOSSES["perceptual"].source,), "ranking")
    if any(f.parameters for f in fits):
        add(("optimistix", "jax"), "solver")
        add(("white1980",), "standard errors")
        add(("kunsch1989",), "spread over angular bands")
    if any(e.maps for e in evidence):
        add(("rusinkiewicz1998",), "half and difference angles")
    if any(e.sphere for e in evidence):
        add(("sharma2005", "colour"), "colour differences")
    for e in evidence:
        for p in e.published.values():
            add((p.reference,), f"published fit of {e.material}")
    entries = [{"text": references.REFERENCES.get(k, k), "uses": ", ".join(u)} for k, u in uses.items()]
    return sorted(entries, key=lambda e: str(e["text"]))


def _plain(text: str) -> str:
    """Text that may stand in an attribute."""
    return text.replace("&", "and").replace('"', "'").replace("<", "").replace(">", "")


def _shown(value: Any) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{k} {_shown(v)}" for k, v in value.items())
    if isinstance(value, (list, tuple)):
        return ", ".join(_shown(v) for v in value)
    return str(value)
