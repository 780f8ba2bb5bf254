"""The words and tables of a report: fits and evidence in, plain values for the template out."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import references
from . import materials, physics, plots, words
from .colours import encode
from .evidence import Evidence
from .gather import fit_key
from .words import significant

if TYPE_CHECKING:
    from ..fitting.result import Fit

View = dict[str, Any]

LOSSES: dict[str, str] = {
    "perceptual": "ranks fits as people do",
    "log": "ln(1 + f cos θi)",
    "low": "log, θo uniform (Löw)",
    "bieron": "log, weighted cos θo",
    "ngan": "(f \u2212 m) cos θi",
    "cuberoot": "cube root of f cos θi",
    "relative": "(f \u2212 m)/m",
}
"""The named losses in the order of the table, and what they compare."""

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
    sections = [_section(k, group, by_source.get(key)) for k, (key, group) in enumerate(groups.items())]
    failed = sum(not f.converged for f in fits)
    summary = f"{words.count(len(fits), 'fit')} of {words.count(len(groups), 'material')}"
    if failed:
        summary += f"; {words.count(failed, 'fit')} failed or did not converge"
    return {
        "title": sections[0]["material"] if len(sections) == 1 else words.count(len(sections), "material"),
        "summary": summary[:1].upper() + summary[1:] + ".",
        "sections": sections,
        "overview": _overview(sections) if len(sections) > 1 else None,
        "grades": [
            {"words": text, "limit": None if math.isinf(limit) else f"≤ {limit:g}", "index": k}
            for k, (limit, text) in enumerate(words.GRADES)
        ],
        "grades_note": words.GRADES_NOTE,
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


def _section(number: int, fits: list[Fit], evidence: Evidence | None) -> View:
    first = fits[0]
    names = labels(fits)
    order = sorted(range(len(fits)), key=lambda k: (not math.isfinite(perceptual(fits[k])), perceptual(fits[k]), k))
    ranked = [(fits[k], names[k]) for k in order]
    rows = {key: m for m, key in enumerate(evidence.keys)} if evidence else {}
    drawn = [(rows[fit_key(f)], label) for f, label in ranked if _shows(f, rows)]
    channel_names = _channel_names(fits, evidence)
    salt = f"brdfit-{number}-"
    return {
        "number": number,
        "material": first.material,
        "anchor": f"m{number}-" + (re.sub(r"[^A-Za-z0-9]+", "-", first.material).strip("-").lower() or "table"),
        "about": _about(fits),
        "headline": _headline(ranked),
        "ranking": [_rank(k + 1, f, label) for k, (f, label) in enumerate(ranked)],
        "tradeoff": _tradeoff(ranked, salt),
        "spheres": _spheres(evidence, drawn, first.material),
        "lobes": _lobes(evidence, drawn, first.material, salt),
        "channels": _channels(evidence, ranked, rows, channel_names, salt),
        "maps": _maps(evidence, drawn, first.material),
        "albedo": _albedo(evidence, drawn, first, salt),
        "losses": _losses(*zip(*ranked, strict=True)),
        "physics": [_physics(f, label, evidence, rows) for f, label in ranked if f.parameters],
        "models": [_model(f, label, channel_names, salt) for f, label in ranked],
        "missing": _missing(evidence, [n for f, n in ranked if f.parameters and not _shows(f, rows)]),
        "overview": {label: (perceptual(f), f.converged) for f, label in zip(fits, names, strict=True)},
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
    settings = sorted(
        {f"loss {f.loss}, measure {f.measure.replace('_', ' ')}, angles at the cell's {f.angles}" for f in fits}
    )
    text = (
        PurePath(f.source).name
        + (f" (SHA-256 {f.sha256[:12]}…)" if f.sha256 else "")
        + ". "
        + "; ".join(settings).capitalize()
        + ". "
    )
    text += (
        f"{words.thousands(used)} of {words.thousands(total)} cells fitted, {words.thousands(masked)} masked as not measured"
    )
    return text + (f", {words.thousands(beyond)} measured but beyond {f.max_angle:g}°." if beyond > 0 else ".")


def _headline(ranked: Sequence[tuple[Fit, str]]) -> str:
    material = ranked[0][0].material
    good = [(f, label) for f, label in ranked if math.isfinite(perceptual(f))]
    if not good:
        return f"No model could be fitted to {material}."
    best, label = good[0]
    error = perceptual(best)
    among = f"Best of {words.number(len(ranked))}" if len(ranked) > 1 else "The one fit"
    text = f"{among} for {material}: {label}. Perceptual error {significant(error, 2)}: {words.grade(error)}."
    if not best.converged:
        text += " This fit did not converge."
    if len(good) > 1:
        second, other = good[1]
        text += f" Next is {other} with {significant(perceptual(second), 2)}"
        good_enough = [g for g in good if perceptual(g[0]) <= words.SEEN and "solve" in g[0].seconds]
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


def _rank(rank: int, f: Fit, label: str) -> View:
    error = perceptual(f)
    solve, passes = f.seconds.get("solve", math.nan), f.passes
    return {
        "rank": str(rank) if math.isfinite(error) else words.NONE,
        "label": label,
        "error": significant(error, 3),
        "grade": words.grade_index(error),
        "words": words.grade(error) if math.isfinite(error) else f"failed: {f.reason}",
        "numbers": sum(v.size for n, v in f.parameters.items() if n not in f.fixed) or words.NONE,
        "solve": words.seconds(solve),
        "pass": words.seconds(solve / passes) if passes else words.NONE,
        "passes": passes or words.NONE,
        "compile": words.seconds(f.seconds.get("compile", math.nan)),
        "converged": f.converged,
        "anchor": _anchor(f, label),
    }


def _anchor(f: Fit, label: str) -> str:
    return re.sub(r"[^A-Za-z0-9]+", "-", f"{f.source}-{f.sha256[:6]}-{label}").strip("-").lower()


def _tradeoff(ranked: Sequence[tuple[Fit, str]], salt: str) -> str | None:
    points = [
        (label, f.seconds["solve"], perceptual(f))
        for f, label in ranked
        if f.seconds.get("solve", 0) > 0 and math.isfinite(perceptual(f)) and perceptual(f) > 0
    ]
    if len(points) < 2:
        return None
    said = "; ".join(f"{label} {significant(e, 2)} in {words.seconds(t)}" for label, t, e in points)
    return plots.tradeoff(points, words.SEEN, f"Perceptual error over the seconds of the solve: {said}", salt + "cost")


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
    known = [n for n in LOSSES if any(n in f.errors for f in fits)]
    known += sorted({n for f in fits for n in f.errors} - set(LOSSES))
    table = []
    for name in known:
        values = [float(f.errors.get(name, math.nan)) for f in fits]
        finite = [v for v in values if math.isfinite(v)]
        best = min(finite) if finite else math.nan
        cells = [{"text": significant(v, 3), "best": v == best and len(finite) > 1} for v in values]
        table.append(
            {"name": name, "about": LOSSES.get(name, ""), "cells": cells, "fitted": any(f.loss == name for f in fits)}
        )
    return {"names": list(names), "rows": table}


def _physics(f: Fit, label: str, evidence: Evidence | None, rows: dict[str, int]) -> View:
    f0 = physics.normal_reflectance(f.model_name, f.parameters)
    width = physics.lobe_width(f.model_name, f.parameters)
    view: View = {"label": label, "f0": None, "width": None, "energy": "not computed", "energy_warn": False}
    if f0 is not None:
        view["f0"] = {
            "value": words.triple(f0.value),
            "expression": f0.expression,
            "remark": f0.remark,
            "kind": materials.kind_of(f0.value),
            "warn": bool(materials.GAP[0] < float(np.mean(f0.value)) < materials.GAP[1] or np.mean(f0.value) > 1),
            "nearest": None,
        }
        if f0.value.shape == (3,) and np.isfinite(f0.value).all():
            substance, distance = materials.nearest(f0.value)
            view["f0"]["nearest"] = substance.name
            view["f0"]["nearest_value"] = " ".join(f"{v:.3g}" for v in substance.f0)
            view["f0"]["distance"] = significant(distance, 2)
            view["f0"]["far"] = distance > 0.15
            view["f0"]["swatch"], view["f0"]["nearest_swatch"] = _hex(f0.value), _hex(np.array(substance.f0))
    if width is not None:
        view["width"] = {
            "half": significant(math.degrees(width.half_width), 3),
            "alpha": significant(width.alpha, 3),
            "roughness": significant(width.roughness, 3),
            "exponent": significant(width.exponent, 3),
        }
    if evidence and evidence.albedo and fit_key(f) in rows:
        m = rows[fit_key(f)]
        angles = tuple(float(a) for a in evidence.albedo.theta_i)
        view["energy"] = physics.energy_verdict(evidence.albedo.fitted[m], evidence.albedo.error[m], angles)
        view["energy_warn"] = view["energy"].startswith(("returns", "albedo"))
    return view


def _hex(linear: np.ndarray) -> str:
    code = np.round(255 * encode(np.clip(linear, 0, 1))).astype(int)
    return "#" + "".join(f"{c:02x}" for c in code)


def _model(f: Fit, label: str, channel_names: tuple[str, ...], salt: str) -> View:
    return {
        "label": label,
        "anchor": _anchor(f, label),
        "formula": _formula(f),
        "converged": f.converged,
        "reason": f.reason,
        "parameters": _parameters(f, channel_names),
        "remarks": _remarks(f, channel_names),
        "time": _time(f),
        "code": f.model is not None,
    }


def _formula(f: Fit) -> str:
    """The first paragraph of the model's own documentation, which holds the formula."""
    doc = (type(f.model).__doc__ or "") if f.model is not None else ""
    return " ".join(doc.split("\n\n")[0].split())


def _parameters(f: Fit, channel_names: tuple[str, ...]) -> View:
    from ..models import parameters_of

    specs = {p.name: p for p in parameters_of(f.model)} if f.model is not None else {}
    governing = f.governing()
    count = max((v.size for v in f.parameters.values()), default=1)
    wide = count <= 4
    rows = []
    for name, value in f.parameters.items():
        spec = specs.get(name)
        flat = np.atleast_1d(value)
        sides = [np.broadcast_to(np.atleast_1d(u.get(name, np.nan)), flat.shape) for u in (f.stderr, f.spread)]
        cells = []
        for c, v in enumerate(flat):
            element = f"{name}[{c}]" if value.ndim else name
            noise, bands = (float(s[c]) for s in sides)
            larger = np.nanmax([noise, bands]) if math.isfinite(noise) or math.isfinite(bands) else math.nan
            cells.append(
                {
                    "channel": channel_names[c] if value.ndim and c < len(channel_names) else "",
                    "value": words.uncertain(float(v), float(larger)),
                    "stderr": significant(noise, 2) if math.isfinite(noise) else None,
                    "spread": significant(bands, 2) if math.isfinite(bands) else None,
                    "fixed": name in f.fixed or element in f.fixed,
                    "undetermined": name in f.undetermined or element in f.undetermined,
                    "bound": any(re.match(re.escape(element) + r"(?![\w\[])", b) for b in f.at_bound),
                }
            )
        rows.append(
            {
                "name": name,
                "cells": cells,
                "shared": value.ndim == 0,
                "meaning": spec.meaning if spec else "",
                "unit": spec.unit if spec else "",
                "range": _range(spec.valid.lower, spec.valid.upper, spec.valid.open_lower, spec.valid.open_upper)
                if spec
                else words.NONE,
                "searched": _range(*spec.search) if spec else words.NONE,
                "governs": governing.get(name),
            }
        )
    heads = list(channel_names[:count]) if count > 1 else ["value"]
    return {"rows": rows, "wide": wide, "heads": heads, "count": count}


def _range(lower: float, upper: float, open_lower: bool = False, open_upper: bool = False) -> str:
    """An interval in words short enough for a table."""
    low = _end(lower)
    high = _end(upper)
    if math.isinf(lower) and math.isinf(upper):
        return "any"
    if math.isinf(upper):
        return f"{'>' if open_lower else '≥'} {low}"
    if math.isinf(lower):
        return f"{'<' if open_upper else '≤'} {high}"
    return f"{low} … {high}"


def _end(x: float) -> str:
    text = words.minus(f"{x:g}")
    if "e" not in text:
        return text
    mantissa, exponent = f"{x:g}".split("e")
    return ("" if mantissa == "1" else words.minus(mantissa) + "·") + "10" + words.superscript(int(exponent))


def _remarks(f: Fit, channel_names: tuple[str, ...]) -> list[View]:
    out: list[View] = []

    def say(text: str, warn: bool = False) -> None:
        out.append({"text": text[:1].upper() + text[1:], "warn": warn})

    def names(elements: Iterable[str]) -> str:
        return words.listed(_element(e, channel_names) for e in elements)

    at_limit, at_box = _bounds(f)
    if at_limit:
        say(f"at the limit of what the model allows: {names(at_limit)}. The data ask for no such part, or for more of it.")
    if at_box:
        say(f"at a bound of the search box: {names(at_box)}. A wider box may fit better.", True)
    if f.undetermined:
        say(f"not determined by the data: {names(f.undetermined)}. Other values do about as well.", True)
    if f.fixed:
        say(f"held fixed: {names(f.fixed)}.")
    pairs = f.strong_correlations()
    if pairs:
        shown = "; ".join(
            f"{_element(b, channel_names)} with {_element(a, channel_names)} ({words.minus(f'{r:.3f}')})"
            for a, b, r in pairs[:6]
        )
        more = f"; and {words.count(len(pairs) - 6, 'more pair')}" if len(pairs) > 6 else ""
        say(f"strongly correlated estimates: {shown}{more}. Trust them together, not one by one.")
    if f.optima and f.starts > 1:
        best = f.optima[0]
        error = f" ({f.loss} error {significant(best.error, 4)})" if math.isfinite(best.error) else ""
        text = f"{words.count(f.starts, 'start')}: {words.number(best.starts)} reached the best optimum{error}"
        others = [
            f"{words.number(o.starts)} reached {significant(o.error, 4)}" for o in f.optima[1:5] if math.isfinite(o.error)
        ]
        text += "".join(f", {o}" for o in others)
        left = f.starts - sum(o.starts for o in f.optima)
        text += f"; {words.number(left)} {'was' if left == 1 else 'were'} not followed to the end." if left > 0 else "."
        say(text)
    elif f.starts == 1:
        say("one start only: a better optimum may exist.", True)
    known = {n for u in (f.stderr, f.spread) for n, v in u.items() if np.isfinite(v).any()}
    governing = {n: g for n, g in f.governing().items() if n in known}
    misfit = [n for n, g in governing.items() if g == "spread"]
    if misfit and len(misfit) == len(governing):
        say(
            "for every parameter the spread over angular bands exceeds the noise: what limits these numbers is the form "
            "of the model, not the measurement."
        )
    elif misfit:
        say(f"the form of the model, not noise, limits {words.listed(misfit)}.")
    if f.model is None and f.parameters:
        say("the code of this model is not part of the package: its numbers are kept, its formula is not.")
    return out


def _element(text: str, channel_names: tuple[str, ...]) -> str:
    """``specular[1]`` as ``specular G``."""

    def name(match: re.Match[str]) -> str:
        k = int(match.group(1))
        return f" {channel_names[k]}" if k < len(channel_names) else match.group(0)

    return re.sub(r"\[(\d+)\]", name, text)


def _bounds(f: Fit) -> tuple[list[str], list[str]]:
    """Parameters at a bound: those where the formula ends, and those where only the search does."""
    from ..models import parameters_of

    valid = {p.name: (p.valid.lower, p.valid.upper) for p in parameters_of(f.model)} if f.model is not None else {}
    limit: list[str] = []
    box: list[str] = []
    for text in f.at_bound:
        match = re.match(r"(\w+)(?:\[(\d+)\])?", text)
        name, index = (match.group(1), int(match.group(2) or 0)) if match else ("", 0)
        value = np.atleast_1d(f.parameters.get(name, np.nan))
        at_limit = index < len(value) and value[index] in valid.get(name, ())
        (limit if at_limit else box).append(text)
    return limit, box


def _time(f: Fit) -> str:
    parts = [f"{k} {words.seconds(f.seconds[k])}" for k in ("load", "prepare", "compile", "solve") if k in f.seconds]
    text = ", ".join(parts)
    if f.passes and "solve" in f.seconds:
        text += f"; {words.thousands(f.passes)} passes over the table, {words.seconds(f.seconds['solve'] / f.passes)} each"
    return text + "." if text else ""


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
        errors = {n: e for n, (e, _) in s["overview"].items() if math.isfinite(e)}
        best = min(errors, key=lambda n: errors[n]) if errors else None
        cells = []
        for n in heads:
            error, converged = s["overview"].get(n, (math.nan, None))
            text = significant(error, 2) if math.isfinite(error) else (words.NONE if converged is None else "failed")
            cells.append({"text": text, "grade": words.grade_index(error), "best": n == best, "doubt": converged is False})
        rows.append({"material": s["material"], "anchor": s["anchor"], "cells": cells, "best": best or "none"})
    wins = {n: sum(r["best"] == n for r in rows) for n in heads}
    best_line = ", ".join(f"{n} {c}" for n, c in sorted(wins.items(), key=lambda i: -i[1]) if c)
    doubts = any(c["doubt"] and c["text"] != "failed" for r in rows for c in r["cells"])
    return {"heads": heads, "rows": rows, "wins": best_line, "doubts": doubts}


def _references(fits: Sequence[Fit], evidence: Sequence[Evidence]) -> list[View]:
    uses: dict[str, list[str]] = {}

    def add(keys: Sequence[str], use: str) -> None:
        for key in keys:
            if use not in uses.setdefault(key, []):
                uses[key].append(use)

    for f in fits:
        if f.model is not None:
            add(type(f.model).references, f"model {f.model_name}")
        add(references.OF_LOSS.get(f.loss, ()), f"loss {f.loss}")
        if f.source.endswith(".binary"):
            add(("merl",), "data")
        if physics.normal_reflectance(f.model_name, f.parameters) is not None:
            add(("hoffman2013",), "F0 of substances")
    if any(math.isfinite(perceptual(f)) for f in fits):
        add(references.OF_LOSS["perceptual"], "ranking")
    if any(f.parameters for f in fits):
        add(("optimistix", "jax"), "solver")
        add(("white1980",), "standard errors")
        add(("kunsch1989",), "spread over angular bands")
    if any(e.maps for e in evidence):
        add(("rusinkiewicz1998",), "half and difference angles")
    if any(e.sphere for e in evidence):
        add(("sharma2005", "colour"), "colour differences")
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
