"""What a report says of one model: its parameters, what to make of them, and what they mean as physics."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import physics
from ..colours import encode
from . import materials, words
from .evidence import Evidence, Published
from .gather import fit_key
from .words import significant

if TYPE_CHECKING:
    from ..fitting.result import Fit
    from ..models import BRDF

View = dict[str, Any]


def anchor(f: Fit, label: str) -> str:
    """Where in the page a model is described."""
    return re.sub(r"[^A-Za-z0-9]+", "-", f"{f.source}-{f.sha256[:6]}-{label}").strip("-").lower()


def physics_view(f: Fit, label: str, evidence: Evidence | None, rows: dict[str, int]) -> View:
    """The row of one model in the table of physical meanings; ``rows`` are the places of fits in the evidence."""
    f0 = physics.normal_reflectance(f.model)
    width = physics.lobe_width(f.model)
    view: View = {"label": label, "f0": None, "width": None, "energy": "not computed", "energy_warn": False}
    if f0 is not None:
        view["f0"] = {
            "value": words.triple(f0),
            "kind": materials.kind_of(f0),
            "warn": bool(materials.GAP[0] < float(np.mean(f0)) < materials.GAP[1] or np.mean(f0) > 1),
        }
        view["f0"] |= _nearest(f, f0)
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
        if f.model is not None and f.model.anisotropic:
            view["energy"] += ", for light along the tangent; of other azimuths this says nothing"
        view["energy_warn"] = view["energy"].startswith(("returns", "albedo"))
    return view


def _nearest(f: Fit, f0: np.ndarray) -> View:
    """The substance that an F0 is near to, or why none is named."""
    if f0.shape != (3,) or not np.isfinite(f0).all():
        return {"nearest": None, "why": "only for three channels", "swatch": None}
    view: View = {"nearest": None, "swatch": _hex(f0)}
    substance, distance = materials.nearest(f0)
    if distance > materials.NEAR:
        return view | {"why": f"none within {words.percent(materials.NEAR)}"}
    if (error := _f0_error(f, f0)) > materials.NEAR:
        return view | {"why": f"none named: F0 is known to ± {words.percent(error)} only"}
    value = " ".join(f"{v:.3g}" for v in substance.f0)
    return view | {
        "nearest": substance.name,
        "nearest_value": value,
        "distance": words.percent(distance),
        "nearest_swatch": _hex(np.array(substance.f0)),
    }


def _f0_error(f: Fit, f0: np.ndarray) -> float:
    """Largest relative error bar of F0: those of the parameters to first order, with their correlations."""
    import jax

    assert f.model is not None  # F0 is its own
    found, count = 0.0, len(f.labels)
    correlation = np.nan_to_num(f.correlation) if f.correlation.shape == (count, count) else np.eye(count)
    for c in range(len(f0)):
        with jax.enable_x64(True):
            slope = _slope()(physics.channel(f.model, c))
        step = np.zeros(len(f.labels))
        for name, value in f.parameters.items():
            label = f"{name}[{c}]" if value.ndim else name
            if label in f.labels:
                step[f.labels.index(label)] = float(getattr(slope, name)) * _error_bar(f, name)[c if value.ndim else 0]
        found = max(found, math.sqrt(max(float(step @ correlation @ step), 0.0)) / max(abs(float(f0[c])), 1e-30))
    return found


@cache
def _slope() -> Any:
    """The derivative of F0 of one channel by each parameter, as a model; made on first use, as it needs JAX."""
    from ..programs import program

    return program(_derivative)


def _derivative(model: BRDF) -> BRDF:
    import jax

    slope: BRDF = jax.grad(lambda m: m.normal_reflectance())(model)
    return slope


def _error_bar(f: Fit, name: str) -> np.ndarray:
    """The larger of noise and spread for each element of a parameter, 0 where neither is known."""
    both = [np.nan_to_num(np.atleast_1d(u.get(name, 0.0))) for u in (f.stderr, f.spread)]
    bar: np.ndarray = np.maximum(*np.broadcast_arrays(*both, np.atleast_1d(f.parameters[name]))[:2])
    return bar


def _hex(linear: np.ndarray) -> str:
    code = np.round(255 * encode(np.clip(linear, 0, 1))).astype(int)
    return "#" + "".join(f"{c:02x}" for c in code)


def model_view(f: Fit, label: str, channel_names: tuple[str, ...], published: Published | None) -> View:
    """The section of one model: formula, parameters with their error bars, the published fit, remarks, time."""
    return {
        "label": label,
        "anchor": anchor(f, label),
        "formula": _formula(f),
        "converged": f.converged,
        "reason": f.reason,
        "parameters": _parameters(f, channel_names),
        "published": _published(f, published) if published else None,
        "remarks": _remarks(f, channel_names),
        "agreed": " ".join(filter(None, (_agreed(f), words.planned(f)))),
        "time": _time(f),
        "code": f.model is not None,
    }


def _formula(f: Fit) -> str:
    """The first paragraph of the model's own documentation, which holds the formula."""
    from ..catalogue import prose

    doc = (type(f.model).__doc__ or "") if f.model is not None else ""
    return prose(doc.split("\n\n")[0])


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


def _published(f: Fit, published: Published) -> View:
    """Errors of this fit and of the published one, under the loss that was fitted and the perceptual one."""
    losses = list(dict.fromkeys((f.loss, "perceptual")))
    rows = []
    for name, errors in (("this fit", f.errors), ("published fit", published.errors)):
        rows.append({"name": name, "errors": [significant(errors.get(loss, math.nan), 3) for loss in losses]})
    said = ""
    fitted, ranking = (f.errors.get(k, math.nan) / published.errors.get(k, math.nan) for k in (f.loss, "perceptual"))
    if fitted < 1 < ranking:
        said = (
            f"The published fit is closer under the perceptual error, which ranks fits here; this fit is closer under "
            f"{f.loss}, which it was fitted by. Where the perceptual error is what counts, fit by it: --loss perceptual."
        )
    return {"source": published.source, "losses": losses, "rows": rows, "said": said}


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
    vague = _vague(f)
    if vague:
        shown = names(f"{e} ({words.uncertain(v, bar)} ± {significant(bar, 2)})" for e, v, bar in vague)
        say(f"not determined by these data, with error bars beyond the values themselves: {shown}.", True)
    for warning in f.warnings:
        say(f"{warning}.", True)
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
    if f.exact:
        say("an exact fit: what is left of the error is rounding, and so are the error bars.")
    elif misfit and len(misfit) == len(governing):
        say(
            "for every parameter the spread over angular bands is at least twice the noise: what limits these numbers is "
            "the form of the model, not the measurement."
        )
    elif misfit:
        say(f"the form of the model, not noise, limits {words.listed(misfit)}.")
    elif governing and all(g == "both" for g in governing.values()):
        say(
            "for every parameter the spread over angular bands is about what noise alone makes it: no sign that the form of "
            "the model limits these numbers."
        )
    if f.model is None and f.parameters:
        say("the code of this model is not part of the package: its numbers are kept, its formula is not.")
    return out


def _vague(f: Fit) -> list[tuple[str, float, float]]:
    """Elements, values and error bars of positive parameters whose error bars exceed them."""
    from ..models import parameters_of

    out = []
    for p in parameters_of(f.model) if f.model is not None else ():
        value = f.parameters[p.name]
        for k, (v, bar) in enumerate(zip(np.atleast_1d(value), _error_bar(f, p.name), strict=True)):
            element = f"{p.name}[{k}]" if value.ndim else p.name
            if p.valid.lower >= 0 and 0 < v < bar and element not in f.undetermined and p.name not in f.undetermined:
                out.append((element, float(v), float(bar)))
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


def _agreed(f: Fit) -> str:
    """What one more exact step over every cell would change, and how the optimum was found."""
    if f.model is None or not f.passes:
        return ""
    search = "compressed search" if f.path == "compressed" else "search that ended on every cell"
    passes = f"{words.thousands(f.passes)} {'pass' if f.passes == 1 else 'passes'} over the table"
    if not f.effort.error_bars:
        return f"Not asked how sure the parameters are ({search}, {passes})."
    if not math.isfinite(f.shift):
        return f"Every cell asked once more: how far the parameters would move cannot be said ({search}, {passes})."
    far = max(f.shift, 0.001)
    digit = 10.0 ** math.floor(math.log10(far))
    far = math.ceil(far / digit - 1e-9) * digit  # up to one digit: what is said is a bound
    return f"Every cell asked once more: no parameter would move by more than {far:g} standard errors ({search}, {passes})."


def _time(f: Fit) -> str:
    parts = [f"{k} {words.seconds(f.seconds[k])}" for k in ("load", "prepare", "compile", "solve") if k in f.seconds]
    return ", ".join(parts) + "." if parts else ""
