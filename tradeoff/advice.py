"""One sentence for each question, made from the numbers."""

from __future__ import annotations

from collections.abc import Sequence

from ..fitting import Fit
from ..models.masking.smith import NODES
from ..reports.words import SEEN, listed, minus, percent, seconds, significant
from .approximations import Approximation
from .exchange import COUNTERPART
from .pareto import front
from .rendering import Rendering
from .settings import Setting
from .smith import Quadrature

STANDARD_ERRORS = 0.1
"""Error of a parameter, in standard errors, that no one can tell from none."""
ROUGH = 0.01
"""Relative error of a parameter that many uses allow."""
NEARLY = 1.1
"""Errors up to this multiple of the smallest one count as about as good."""
UNSEEN = 1e-3
"""Relative difference of BRDF values that no image of eight bits shows."""


def settings_advice(measured: Sequence[Setting], optimum: Fit | None) -> str:
    """How hard to fit."""
    if not measured or optimum is None:
        return "Nothing asked for could be fitted, so that no setting could be measured."
    default = next((s for s in measured if s.family == "default"), measured[0])
    exact = next((s for s in measured if s.effort.path == "exact" and s.effort.cells == 1), None)
    said = (
        f"Fitting {optimum.model_name} with default settings takes {seconds(default.seconds.median)} and ends "
        f"{significant(default.standard_errors, 2)} standard errors from the optimum of all cells"
    )
    if exact is not None:
        said += f" (a search over every cell: {seconds(exact.seconds.median)})"
    sure = _fastest(measured, lambda s: s.standard_errors <= STANDARD_ERRORS)
    if sure is None:
        said += f"; no setting stays within {STANDARD_ERRORS:g}"
    elif _clearly_faster(sure, default):
        said += (
            f"; {sure.label} takes {seconds(sure.seconds.median)} and stays within {STANDARD_ERRORS:g} standard errors too"
        )
    else:
        said += f"; nothing that stays within {STANDARD_ERRORS:g} is clearly faster"
    rough = _fastest(measured, lambda s: s.relative <= ROUGH)
    if rough is not None and _clearly_faster(rough, sure or default):
        said += (
            f"; where {percent(ROUGH)} of a parameter does not matter, {rough.label} takes {seconds(rough.seconds.median)}"
        )
    return said + "."


def _clearly_faster(a: Setting, b: Setting) -> bool:
    """By more than the spread and a tenth."""
    return a.seconds.high < b.seconds.low and NEARLY * a.seconds.median < b.seconds.median


def _fastest(measured: Sequence[Setting], allowed: object) -> Setting | None:
    return min((s for s in measured if allowed(s)), key=lambda s: s.seconds.median, default=None)  # type: ignore[operator]


def rendering_advice(drawn: Sequence[Rendering], seen: float = SEEN) -> str:
    """Which model to render with; up to ``seen`` no one sees an error, 0 where that is not known."""
    if not drawn:
        return "No model could be fitted, so that none can be rendered."
    best = min(drawn, key=lambda r: r.errors["perceptual"])
    limit = max(seen, NEARLY * best.errors["perceptual"])
    good = [r for r in drawn if r.errors["perceptual"] <= limit]
    pick = min(good, key=lambda r: r.seconds.median * r.errors["perceptual"])
    near = "hardly anyone sees" if pick.errors["perceptual"] <= seen else f"within {NEARLY - 1:.0%} of the smallest"
    said = (
        f"Render with {pick.label}: {nanoseconds(pick)} a direction for a perceptual error of "
        f"{significant(pick.errors['perceptual'])}"
    )
    said += f", which {near}" if near.startswith("hardly") else f", {near}" if pick.model != best.model else ", the smallest"
    kept = [drawn[i] for i in front([(r.seconds.median, r.errors["perceptual"]) for r in drawn])]
    dearer = [r for r in kept if r.seconds.median > pick.seconds.median]
    cheaper = [r for r in kept if r.seconds.high < pick.seconds.low]
    if dearer:
        gain = 1 - dearer[0].errors["perceptual"] / pick.errors["perceptual"]
        times = dearer[0].seconds.median / pick.seconds.median
        said += f"; {dearer[0].label} has {percent(gain)} less error for {significant(times, 2)} times the time"
    else:
        said += "; no dearer model is better on this material"
    if cheaper:
        worse = cheaper[-1].errors["perceptual"] / pick.errors["perceptual"]
        times = pick.seconds.median / cheaper[-1].seconds.median
        faster = f"{cheaper[-1].label} is {significant(times, 2)} times as fast"
        said += f", and {faster} with {significant(worse, 2)} times the error"
    return said + "."


def nanoseconds(r: Rendering | Approximation | Quadrature) -> str:
    """Median time of one direction."""
    return f"{significant(1e9 * r.seconds.median, 2)} ns"


def quadrature_advice(rules: Sequence[Quadrature]) -> str:
    """How many nodes for Smith's integral."""
    if not rules:
        return "No model with Smith's integral could be fitted."
    said = []
    for name in dict.fromkeys(r.model for r in rules):
        mine = [r for r in rules if r.model == name]
        own = next(r for r in mine if r.rule == "even in u" and r.nodes == NODES)
        table = next(r for r in mine if r.rule == "table")
        enough = [r for r in mine if r.rule != "table" and r.largest <= UNSEEN] or [own]
        fewest = min(enough, key=lambda r: (r.nodes, r.largest))
        said.append(
            f"{name} keeps its values to {percent(UNSEEN)} with {fewest.nodes} nodes {fewest.rule} ({nanoseconds(fewest)} a "
            f"direction; the package's {NODES}: {nanoseconds(own)}), and to {significant(table.largest, 1)} with masking "
            f"from a table made once ({nanoseconds(table)})"
        )
    return "; ".join(said) + "."


def fresnel_advice(forms: Sequence[Approximation]) -> str:
    """Whether Schlick's approximation does."""
    return _exchange_advice(forms, "No model with an exchangeable Fresnel term could be fitted.")


def masking_advice(forms: Sequence[Approximation]) -> str:
    """Whether a simpler masking does."""
    said = _exchange_advice(forms, "No microfacet model could be fitted.")
    return f"{said[:-1]} (Smith's is read from a table made once)." if forms else said


def without_spikes(advice: str, spikes: Sequence[str]) -> str:
    """The advice, and which models it leaves out."""
    if not spikes:
        return advice
    return f"{advice} Left out: {listed(spikes)}, fitted with a lobe that is a spike between the measured directions."


def _exchange_advice(forms: Sequence[Approximation], nothing: str) -> str:
    """Errors and the compiler's counts decide, which are the same in every run; times are only told."""
    if not forms:
        return nothing
    said = []
    for own in (f for f in forms if f.own):
        other = next(f for f in forms if f.model == own.model and f.form == COUNTERPART[own.form])
        mine, its = _form(own.form), _form(other.form)
        if not other.refitted:
            said.append(f"in {own.model} keep {mine}: no fit with {its} is of use")
            continue
        changes = {k: other.refitted[k] / own.refitted[k] - 1 for k in other.refitted}
        cheaper = NEARLY * other.operations.count < own.operations.count
        better = changes["perceptual"] < 1 / NEARLY - 1
        worse = changes["perceptual"] > NEARLY - 1
        if better or (cheaper and not worse):
            why = "the perceptual error is smaller" if better else "to the eye about as good, with fewer operations"
            verdict = f"take {its}, not {mine}: {why}"
        else:
            why = "the perceptual error is larger" if worse else "to the eye about as good, and not clearly cheaper"
            verdict = f"keep {mine}, not {its}: {why}"
        effect = listed(f"{_signed(v)} ({k})" for k, v in changes.items())
        said.append(
            f"in {own.model} {verdict}; {its} {_cost(own, other)}, moves 1 value in 100 by more than {percent(other.large)} "
            f"and, fitted again, changes the error by {effect}"
        )
    text = "; ".join(said) + "."
    return text[0].upper() + text[1:]


def _cost(own: Approximation, other: Approximation) -> str:
    """Time of the other form, where it is clear of the spread and the operations agree; and the operations."""
    more = other.operations.count / own.operations.count - 1
    ratio = other.seconds.median / own.seconds.median
    cost = "takes the same time as far as can be told"
    if other.seconds.low > own.seconds.high and more > 0:
        cost = f"takes {significant(ratio, 2)} times the time"
    elif other.seconds.high < own.seconds.low and more < 0:
        cost = f"is {significant(1 / ratio, 2)} times as fast"
    return f"{cost} ({_signed(more)} operations)"


def _form(form: str) -> str:
    return f"{form.split(',')[0]} masking" if form.startswith(("Smith", "V-")) else form


def _signed(share: float) -> str:
    return minus(f"{100 * share:+.1f} %")


__all__ = [
    "fresnel_advice",
    "masking_advice",
    "nanoseconds",
    "quadrature_advice",
    "rendering_advice",
    "settings_advice",
    "without_spikes",
]
