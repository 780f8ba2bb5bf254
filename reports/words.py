"""Numbers and verdicts as a reader wants them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ..fitting import Fit

NONE = "\u2013"
"""Stands where there is no number."""

SEEN = 0.012
"""Perceptual error up to which hardly anyone sees a difference (Lavoué et al. 2021, as recomputed in the project)."""

GRADES: tuple[tuple[float, str], ...] = (
    (SEEN, "hardly anyone sees a difference"),
    (2 * SEEN, "seen by a careful eye, side by side"),
    (4 * SEEN, "a visible difference"),
    (math.inf, "a plain difference"),
)
"""Upper limits and words. Only the first limit is measured; the others are steps of two chosen here."""

ERROR_NOTE = (
    "The perceptual error is the RMS difference of cbrt(f cos θi cos θo), weighted with cos θo. On 358 pairs of published "
    "fits and materials judged by 1005 people it ranks fits about as they do (rank correlation .65)."
)
GRADES_NOTE = (
    "At 0.012 or less, 90 % of pairs are judged no farther from the material than near-exact approximations are: “hardly "
    "anyone sees a difference”. That one limit is measured (with stand-ins for the materials); the words beyond it are "
    "steps of a factor of two, chosen here. They hold for cells that count by solid angle and materials that are not black."
)

BLACK = 1e-4
"""Mean reflectance below which the limits say nothing: they are of absolute values, and no material judged was near it."""


def no_word(measure: str, reflectance: float = math.nan) -> str:
    """Why a perceptual error has no word here, empty where it has one; ``reflectance`` is NaN where it is not known."""
    if measure != "solid_angle":
        counted = "every cell counts once" if measure == "cells" else "a scene weights the cells"
        return f"no word: {counted}, and what people see was measured with solid angles"
    if reflectance < BLACK:
        return f"no word: nearly black, {share(reflectance)} of the light is returned"
    return ""


def grade(error: float) -> str:
    """What a perceptual error means, in words."""
    if not math.isfinite(error):
        return "no error could be computed"
    return next(words for limit, words in GRADES if error <= limit)


def grade_index(error: float) -> int | None:
    """Position in :data:`GRADES`, for colour; None without a number."""
    return next((k for k, (limit, _) in enumerate(GRADES) if error <= limit), None) if math.isfinite(error) else None


def thousands(n: float) -> str:
    """A whole number with thin spaces between groups of three digits."""
    return f"{n:,.0f}".replace(",", "\u202f")


def significant(x: float, digits: int = 3) -> str:
    """A number with so many significant digits; powers of ten beyond 1e-4 and 1e6."""
    x = float(x)
    if not math.isfinite(x):
        return NONE
    if x == 0:
        return "0"
    magnitude = math.floor(math.log10(abs(float(f"{x:.{digits - 1}e}"))))
    if -4 <= magnitude < 6:
        decimals = max(0, digits - 1 - magnitude)
        rounded = round(x, digits - 1 - magnitude)
        return minus(f"{rounded:.{decimals}f}")
    mantissa, exponent = f"{x:.{digits - 1}e}".split("e")
    return minus(f"{mantissa}·10") + superscript(int(exponent))


def minus(text: str) -> str:
    """Text with a typographic minus sign."""
    return text.replace("-", "\u2212")


def superscript(n: int) -> str:
    """An integer as superscript characters."""
    return "".join("⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".index(c)] for c in str(n))


def uncertain(value: float, sigma: float) -> str:
    """A value with the digits that an uncertainty leaves it: to the second digit of ``sigma``.

    Four digits where there is no uncertainty to go by, never more than ten.
    """
    if not math.isfinite(sigma) or sigma <= 0 or not math.isfinite(value) or value == 0:
        return significant(value, 4)
    digits = math.floor(math.log10(abs(value))) - math.floor(math.log10(sigma)) + 2
    return significant(value, min(max(digits, 1), 10))


def seconds(t: float) -> str:
    """A duration."""
    if not math.isfinite(t):
        return NONE
    if t == 0:
        return "0 s"
    if t < 0.001:
        return f"{significant(t * 1e6, 2)} µs"
    if t < 1:
        return f"{significant(t * 1000, 3 if t >= 0.1 else 2)} ms"
    return f"{significant(t, 3)} s" if t < 120 else f"{thousands(t)} s"


def percent(x: float) -> str:
    """A share."""
    return f"{100 * x:.1f} %" if math.isfinite(x) else NONE


def number(n: int) -> str:
    """A count in words, up to twelve."""
    words = ["no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve"]
    return words[n] if n < len(words) else thousands(n)


def count(n: int, noun: str) -> str:
    """A count and its noun: ``one start``, ``five models``."""
    return f"{number(n)} {noun if n == 1 else noun + 's'}"


def listed(items: Iterable[str]) -> str:
    """``a, b and c``."""
    things = list(items)
    return things[0] if len(things) == 1 else f"{', '.join(things[:-1])} and {things[-1]}" if things else ""


def triple(values: Sequence[float] | np.ndarray, digits: int = 3) -> str:
    """Values of the channels in a row."""
    return " ".join(significant(v, digits) for v in np.atleast_1d(values))


def share(x: float) -> str:
    """A share that may be very small, to one digit."""
    return f"{significant(100 * x, 1)} %"


def planned(f: Fit) -> str:
    """What was asked of a fit, what was predicted of the settings chosen, and what came out; empty if nothing was asked."""
    p = f.plan
    if p is None:
        return ""
    asked = []
    if p.tolerance is not None:
        asked.append(f"at most {share(p.tolerance)} above the best error")
    if p.time_budget is not None:
        asked.append(f"in {seconds(p.time_budget)}")
    took = f.seconds["prepare"] + f.seconds["solve"]
    gain = f"one more step over every cell would take {share(max(f.gain, 0.0))} off the error; it took {seconds(took)}"
    if p.excess is None or p.seconds is None:
        predicted = "nothing, for lack of measurements of this model, so the usual settings were taken"
        return f"Asked: {' and '.join(asked)}. Predicted: {predicted}. Came out: {gain}."
    cannot = "" if p.holds else ", which is not what was asked; no setting is predicted to keep it"
    predicted = f"{share(p.excess)} at most in 19 of 20 materials, in {seconds(p.seconds)}{cannot}"
    return f"Asked: {' and '.join(asked)}. Predicted: {predicted}. Came out: {gain}."
