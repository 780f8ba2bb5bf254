"""Settings that trade time for accuracy: each does what it says, and results remember which they were made with."""

from __future__ import annotations

import json

import brdfit
import numpy as np
import pytest
from brdfit import Effort
from brdfit.data.synthetic import Relative, generate
from brdfit.fitting.effort import ERRORS
from brdfit.fitting.result import from_record
from brdfit.reports.model_section import _agreed


@pytest.fixture(scope="module")
def table():
    """A material that Ward cannot reproduce, with noise."""
    return generate("misfit-two-lobes", grid=(30, 20, 60), noise=[Relative(0.02)], seed=1)[0]


def shift(fit: brdfit.Fit, other: brdfit.Fit) -> float:
    """Largest difference of parameters in standard errors."""
    return max(float(np.max(np.abs(fit.parameters[n] - other.parameters[n]) / other.stderr[n])) for n in fit.parameters)


def test_paths_agree_at_the_optimum(table):
    exact = brdfit.fit(table, "ward", effort=Effort(path="exact", rtol=1e-13))
    auto = brdfit.fit(table, "ward")
    assert (exact.path, auto.path) == ("exact", "compressed")
    assert exact.shift < 0.01  # the optimum of the cells themselves
    # what compression moves is what the judgement of the cells said it would, to first order, and tolerated
    assert shift(auto, exact) < 0.1
    assert shift(auto, exact) == pytest.approx(auto.shift, rel=0.2, abs=0.01)


def test_more_nodes_are_closer(table):
    """The error of compression falls faster than any power of the number of nodes: from 4 to 8 by far more than 10."""
    few, more = (brdfit.fit(table, "ward", effort=Effort(path="compressed", nodes=k)) for k in (4, 8))
    assert few.path == more.path == "compressed"
    assert more.shift < few.shift / 10


def test_a_subsample_is_worse_and_says_so(table):
    """Cells left out move parameters by about sqrt(1/share) standard errors, which the judgement of all cells sees."""
    part = brdfit.fit(table, "ward", effort=Effort(path="exact", cells=0.1))
    whole = brdfit.fit(table, "ward", effort=Effort(path="exact"))
    assert part.errors["log"] > whole.errors["log"]
    assert part.shift > 1
    assert part.passes < whole.passes
    for name, value in whole.stderr.items():  # error bars are of all cells either way
        np.testing.assert_allclose(part.stderr[name], value, rtol=0.3)


def test_from_the_given_start_alone(table):
    """With no shapes of its own a search begins where it is told, and in nothing else."""
    near = brdfit.fit(table, "ward", start={"alpha": 0.2}, effort=Effort(shapes=0))
    assert near.starts == 1
    assert near.errors["log"] == pytest.approx(brdfit.fit(table, "ward").errors["log"], rel=1e-6)
    assert brdfit.fit(table, "ward", effort=Effort(shapes=0)).starts == 1


def test_without_error_bars(table):
    """The same optimum and errors; nothing is said of how sure they are, and a report can be made of it."""
    bare, whole = (brdfit.fit(table, "ward", effort=Effort(error_bars=b)) for b in (False, True))
    assert bare.converged
    assert bare.at_bound == whole.at_bound
    for name, value in whole.parameters.items():
        np.testing.assert_array_equal(bare.parameters[name], value)
        assert np.isnan(bare.stderr[name]).all()
        assert np.isnan(bare.spread[name]).all()
    # other sums of the same squares
    assert bare.errors == pytest.approx(whole.errors, rel=1e-12)
    assert np.isnan(bare.shift)
    assert "Not asked how sure" in _agreed(bare)
    assert "Every cell asked" in _agreed(whole)
    assert json.loads(json.dumps(bare.record()))["stderr"]["alpha"] is None


@pytest.mark.parametrize("loss", ["log", "perceptual"])  # without a weight of its own and with one
def test_errors_by_rows(table, loss):
    """The error of the fit's own loss as the compressed rows have it, what they leave out included: that of all cells up to
    what is lost by compression, 1e-3 at most.
    """
    by_rows, by_cells = (
        brdfit.fit(table, "ward", loss=loss, effort=Effort(error_bars=False, errors=e)) for e in ERRORS[::-1]
    )
    assert by_rows.errors[loss] == pytest.approx(by_cells.errors[loss], rel=1e-3)
    assert {name for name, e in by_rows.errors.items() if np.isfinite(e)} == {loss}
    assert by_rows.passes == by_cells.passes - 1
    with pytest.raises(ValueError, match="errors='rows' goes without error bars, which ask every cell"):
        Effort(errors="rows")


def test_errors_of_cells_where_there_are_no_rows(table):
    """A loss that cannot be compressed, and a search on the cells, end with the errors of all cells under every loss."""
    for options in ({"loss": "relative"}, {"path": "exact"}):
        effort = Effort(path=options.pop("path", "auto"), error_bars=False, errors="rows")
        assert np.isfinite(list(brdfit.fit(table, "ward", effort=effort, **options).errors.values())).all()


def test_fewer_starts(table):
    one, more = (brdfit.fit(table, "gtr", effort=Effort(starts=k)) for k in (1, 7))
    assert sum(o.starts for o in one.optima) < sum(o.starts for o in more.optima)
    assert one.errors["log"] >= more.errors["log"] * (1 - 1e-9)


def test_result_remembers(table):
    effort = Effort(path="compressed", nodes=4, starts=2, rtol=1e-5)
    fit = brdfit.fit(table, "lambert", effort=effort)
    assert from_record(json.loads(json.dumps(fit.record()))).effort == fit.effort == effort


@pytest.mark.parametrize(
    ("values", "named"),
    [
        ({"path": "fast"}, "unknown path 'fast': choose from auto, compressed, exact"),
        ({"nodes": 1}, "nodes must be at least 2, not 1"),
        ({"cells": 0.0}, r"cells must lie in \(0, 1\], not 0"),
        ({"starts": 0}, "starts must be at least 1, not 0"),
        ({"rtol": 1.0}, r"rtol must lie in \(0, 1\), not 1"),
    ],
)
def test_values_out_of_range(values, named):
    with pytest.raises(ValueError, match=named):
        Effort(**values)
