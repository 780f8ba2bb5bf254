"""How hard a fit tries: every setting that trades time for accuracy, in one place."""

from __future__ import annotations

from dataclasses import dataclass

PATHS = ("auto", "compressed", "exact")
ERRORS = ("cells", "rows")


@dataclass(frozen=True)
class Effort:
    """Settings of a fit that cost time and buy accuracy; the defaults are those of a fit that can be relied on.

    Raises ValueError for a value out of range.
    """

    path: str = "auto"
    """``"compressed"``: rows along phi_d stand for their cells (:mod:`brdfit.fitting.compression`). ``"exact"``: every cell
    counts in every step. ``"auto"``: compressed, judged by all cells, and exact from there on if they disagree."""
    nodes: int = 10
    """Nodes of a compressed row, at least 2; also the cells of a row that a block of the table has."""
    cells: float = 1.0
    """Share of the table that an exact search looks at, in (0, 1]: below 1 it is a subsample. Error bars and errors are
    always those of all cells."""
    shapes: float = 1.0
    """Share of the model's starting shapes that are tried, in [0, 1], spread over all of them. 0: the start that is given
    alone, or the first shape if none is."""
    starts: int = 7
    """How many starts are polished after their colours were fitted, of each chart; at least 1. Seven find the best
    optimum of every synthetic truth and of 200 pairs of real materials and models; five miss a channel of ``sgd-00``, three
    the ``gtr`` of red-phenolic."""
    rtol: float = 1e-9
    """Relative decrease of the cost in a step below which the last search ends, in (0, 1)."""
    error_bars: bool = True
    """Whether every cell is asked at the end how sure the parameters are and whether the compressed table was good enough:
    a third to half of a fit. Without, all of that is NaN and the path never changes."""
    errors: str = "cells"
    """``"cells"``: errors are those of all cells, under every named loss. ``"rows"``, of a fit that ends on the compressed
    table and has no error bars: as its rows have it, under the loss that was fitted alone, the others NaN. It takes half off
    what is left of a fit; docs/comparison.md says how far that error is from the one of all cells."""

    def __post_init__(self) -> None:
        if self.path not in PATHS:
            raise ValueError(f"effort: unknown path {self.path!r}: choose from {', '.join(PATHS)}")
        if self.errors not in ERRORS:
            raise ValueError(f"effort: unknown errors {self.errors!r}: choose from {', '.join(ERRORS)}")
        if self.errors == "rows" and self.error_bars:
            raise ValueError("effort: errors='rows' goes without error bars, which ask every cell; add error_bars=False")
        if self.nodes < 2:
            raise ValueError(f"effort: nodes must be at least 2, not {self.nodes}")
        if not 0 < self.cells <= 1:
            raise ValueError(f"effort: cells must lie in (0, 1], not {self.cells:g}")
        if not 0 <= self.shapes <= 1:
            raise ValueError(f"effort: shapes must lie in [0, 1], not {self.shapes:g}")
        if self.starts < 1:
            raise ValueError(f"effort: starts must be at least 1, not {self.starts}")
        if not 0 < self.rtol < 1:
            raise ValueError(f"effort: rtol must lie in (0, 1), not {self.rtol:g}")


DEFAULT = Effort()

__all__ = ["DEFAULT", "ERRORS", "PATHS", "Effort"]
