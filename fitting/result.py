"""What a fit returns: parameters, how sure they are, how well they fit, and what it took."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..files import plain
from ..models import BRDF, build, parameters_of, variants
from .effort import DEFAULT, Effort
from .plan import Plan

Reals = NDArray[np.float64]
Named = dict[str, Reals]

EXACT_FIT = "exact fit"
"""How the reason begins of a fit whose error is rounding."""
CLEAR = 2.0
"""How many times the other an error bar is that limits a parameter. A jackknife over B bands is itself known to about
1/sqrt(2 (B - 1)), less where bands count unevenly, and where the model is right both bars estimate the same."""


@dataclass(frozen=True)
class Optimum:
    """One distinct optimum among the starts: its error under the fitted loss and how many starts ended there."""

    error: float
    starts: int


@dataclass(frozen=True, eq=False)
class Fit:
    """A fitted model. A fit that failed is a result too: ``converged`` is False and ``reason`` says why.

    Dicts by parameter name hold float64 arrays of shape ``[]`` (shared) or ``[C]`` (per channel). An uncertainty that
    cannot be given, of a parameter that the data do not determine, is NaN (null in files), never 0.
    """

    material: str
    source: str
    sha256: str
    angles: str
    model_name: str
    loss: str
    measure: str
    max_angle: float
    """Largest polar angle used, degrees."""

    model: BRDF | None
    """The fitted model, callable; None only where no cell could be fitted."""
    parameters: Named
    stderr: Named
    """Statistical standard error (sandwich form): what noise that is independent from cell to cell allows."""
    spread: Named
    """Delete-one-block jackknife over angular bands: what changes when a band of angles is left out."""
    covariance: dict[str, dict[str, Reals]]
    """Statistical covariance by pair of parameters: ``covariance[a][b]`` has shape ``a.shape + b.shape``."""
    converged: bool
    reason: str
    errors: dict[str, float]
    """Error under every named loss, sqrt(sum w r^2 / sum w) over the fitted cells and channels; NaN for what was not asked
    for (``Effort(errors="rows")``)."""
    cells: dict[str, int]
    """used (fitted), masked (not measured), total; the rest is measured but beyond ``max_angle``."""
    seconds: dict[str, float]
    """load, prepare, compile, solve; waiting for threads that were busy with other fits is in none of them."""

    fixed: tuple[str, ...] = ()
    at_bound: tuple[str, ...] = ()
    """Parameters at a bound of the search box, as ``specular[1] = 0 (lower)``."""
    labels: tuple[str, ...] = ()
    """Names of the rows of :attr:`correlation`: ``diffuse[0]``, ..., ``alpha``."""
    correlation: Reals = field(default_factory=lambda: np.zeros((0, 0)))
    undetermined: tuple[str, ...] = ()
    """Labels of parameters that the data do not determine."""
    warnings: tuple[str, ...] = ()
    """What else to know before its numbers are used, in words."""
    starts: int = 0
    optima: tuple[Optimum, ...] = ()
    """Distinct optima, best first."""
    passes: int = 0
    """Passes over the whole table."""
    path: str = "exact"
    """Which residuals the optimum is one of: of every cell (``exact``), or of rows along phi_d compressed to a few nodes
    each (``compressed``), to which the cells then agreed."""
    shift: float = 0.0
    """Standard errors by which one more exact step over all cells would move the parameter that it moves most."""
    gain: float = 0.0
    """Share of the error that this step would take off."""
    effort: Effort = DEFAULT
    """The settings it was made with."""
    plan: Plan | None = None
    """How the settings were chosen, where a tolerance or a time budget was given."""

    def strong_correlations(self, threshold: float = 0.95) -> list[tuple[str, str, float]]:
        """Pairs of parameters whose estimates are correlated beyond ``threshold``, strongest first."""
        n = len(self.labels)
        pairs = [
            (self.labels[i], self.labels[j], float(self.correlation[i, j]))
            for i in range(n)
            for j in range(i)
            if abs(self.correlation[i, j]) > threshold
        ]
        return sorted(pairs, key=lambda p: -abs(p[2]))

    @property
    def exact(self) -> bool:
        """Whether the error is rounding, so that its error bars are, too."""
        return self.reason.startswith(EXACT_FIT)

    def governing(self) -> dict[str, str]:
        """For each parameter what limits it: noise (``"stderr"``), the form of the model (``"spread"``), or ``"both"``.

        One of the two limits where it is at least :data:`CLEAR` times the other, by the largest of the channels.
        """
        return {
            n: _larger(np.nanmax(self.stderr[n], initial=0), np.nanmax(self.spread[n], initial=0))
            for n in self.parameters
            if n in self.stderr and n in self.spread
        }

    def __repr__(self) -> str:
        """What was fitted, how well, and what to look at: at most three lines."""
        others = [f"{n} {e:.3g}" for n, e in self.errors.items() if n == "perceptual" != self.loss]
        fitted = f"{self.loss} error {self.errors.get(self.loss, np.nan):.3g} (fitted)"
        outcome = "converged" if self.converged else "not converged"
        text = f"Fit({self.material} by {self.model_name}, {outcome}: {self.reason}"
        if self.errors:
            text += f"\n    {', '.join([fitted, *others])}"
        if self.at_bound:
            more = f" and {len(self.at_bound) - 1} more" if len(self.at_bound) > 1 else ""
            text += f"\n    at a bound: {self.at_bound[0]}{more}"
        return text + ")"

    def record(self) -> dict[str, Any]:
        """The fit as plain JSON values (the format of fits.json); NaN becomes null."""
        return {
            "material": self.material,
            "source": self.source,
            "sha256": self.sha256,
            "angles": self.angles,
            "model": self.model_name,
            "loss": self.loss,
            "measure": self.measure,
            "max_angle": self.max_angle,
            "parameters": plain(self.parameters),
            "stderr": plain(self.stderr),
            "spread": plain(self.spread),
            "covariance": {a: plain(row) for a, row in self.covariance.items()},
            "fixed": list(self.fixed),
            "at_bound": list(self.at_bound),
            "undetermined": list(self.undetermined),
            "warnings": list(self.warnings),
            "labels": list(self.labels),
            "correlation": plain(self.correlation),
            "converged": self.converged,
            "reason": self.reason,
            "errors": plain(self.errors),
            "cells": dict(self.cells),
            "seconds": {k: round(v, 6) for k, v in self.seconds.items()},
            "starts": self.starts,
            "optima": [{"error": plain(o.error), "starts": o.starts} for o in self.optima],
            "passes": self.passes,
            "path": self.path,
            "shift": plain(self.shift),
            "gain": plain(self.gain),
            "effort": asdict(self.effort),
            "plan": None if self.plan is None else plain(asdict(self.plan)),
        }


def from_record(record: dict[str, Any]) -> Fit:
    """A fit from its JSON record. Models that are not of the package come back with ``model`` None."""
    parameters = {k: np.asarray(v, float) for k, v in record["parameters"].items()}
    model = None
    try:
        for candidate in variants(record["model"]):
            if parameters and {p.name for p in parameters_of(candidate)} == set(parameters):
                model = build(candidate, dict(parameters))
    except ValueError:
        pass  # a model from outside the package: its numbers are kept, its code is not here

    def named(key: str) -> Named:
        return {k: _array(v) for k, v in record.get(key, {}).items()}

    return Fit(
        **{k: record[k] for k in ("material", "source", "sha256", "angles", "loss", "measure", "converged", "reason")},
        model_name=record["model"],
        max_angle=record.get("max_angle", 80.0),
        model=model,
        parameters=parameters,
        stderr=named("stderr"),
        spread=named("spread"),
        covariance={a: {b: _array(v) for b, v in row.items()} for a, row in record.get("covariance", {}).items()},
        errors={k: float("nan") if v is None else v for k, v in record["errors"].items()},
        cells=record["cells"],
        seconds=record["seconds"],
        fixed=tuple(record.get("fixed", ())),
        at_bound=tuple(record["at_bound"]),
        undetermined=tuple(record.get("undetermined", ())),
        warnings=tuple(record.get("warnings", ())),
        labels=tuple(record.get("labels", ())),
        correlation=_array(record.get("correlation", [])),
        starts=record.get("starts", 0),
        optima=tuple(
            Optimum(float("nan") if o["error"] is None else o["error"], o["starts"]) for o in record.get("optima", [])
        ),
        passes=record.get("passes", 0),
        path=record.get("path", "exact"),
        shift=record.get("shift") or 0.0,
        gain=record.get("gain") or 0.0,
        effort=Effort(**record.get("effort", {})),
        plan=None if record.get("plan") is None else Plan(**record["plan"]),
    )


def _larger(stderr: float, spread: float) -> str:
    if spread > 0 and spread >= CLEAR * stderr:
        return "spread"
    return "stderr" if stderr > 0 and stderr >= CLEAR * spread else "both"


def _array(value: Any) -> Reals:
    """Array of nested lists in which None stands for NaN."""
    return (
        np.array(value, dtype=object).astype(float)
        if np.ndim(value)
        else np.asarray(np.nan if value is None else value, float)
    )
