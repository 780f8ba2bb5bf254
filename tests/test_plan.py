"""Settings chosen by a tolerance or a time budget: the ladder, the choice, and what a fit says of both."""

import json

import brdfit
import numpy as np
import pytest
from brdfit import cli
from brdfit.fitting import plan as module
from brdfit.fitting.plan import RUNGS, expected, plan
from brdfit.fitting.result import from_record
from brdfit.reports.words import planned

LADDER = {
    "yardstick": 1.0,
    "cells": 1000,
    "models": {"ward": [{"excess": e, "seconds": s} for e, s in ((0.03, 0.1), (0.004, 0.2), (1e-4, 0.4), (1e-8, 0.8))]},
}


@pytest.fixture
def ladder(monkeypatch):
    """A ladder of round numbers, on a machine as fast as the one that made it."""
    monkeypatch.setattr(module, "_measured", lambda: LADDER)
    monkeypatch.setattr(module, "yardstick", lambda: 1.0)


@pytest.mark.parametrize(
    ("tolerance", "budget", "rung", "holds"),
    [
        (0.05, None, 0, True),
        (0.01, None, 1, True),
        (1e-3, None, 2, True),
        (1e-7, None, 3, True),
        (1e-9, None, 3, False),  # the best there is, and it says that it does not hold
        (None, 0.05, 0, False),
        (None, 0.25, 1, True),
        (None, 10.0, 3, True),
        (0.01, 0.3, 1, True),
        (0.01, 0.1, 1, False),
    ],
)
def test_the_cheapest_that_holds(ladder, tolerance, budget, rung, holds):
    chosen = plan("ward", 1000, tolerance, budget)
    assert (chosen.rung, chosen.holds) == (rung, holds)


def test_times_grow_with_the_table_and_the_machine(ladder, monkeypatch):
    monkeypatch.setattr(module, "yardstick", lambda: 3.0)
    assert [e.seconds for e in expected("ward", 2000)] == pytest.approx([0.6, 1.2, 2.4, 4.8])
    assert plan("ward", 2000, None, 1.5).rung == 1


def test_of_an_unknown_model_nothing_is_predicted(ladder):
    chosen = plan("mine", 1000, 0.01, None)
    assert RUNGS[chosen.rung] == brdfit.Effort()
    assert chosen.excess is chosen.seconds is None
    assert not chosen.holds


@pytest.mark.parametrize("wrong", [{"tolerance": 0.0}, {"tolerance": 1.0}, {"time_budget": 0.0}, {"time_budget": np.inf}])
def test_values_out_of_range(ladder, wrong):
    with pytest.raises(ValueError, match=r"tolerance|budget"):
        plan("ward", 1000, **{"tolerance": None, "time_budget": None, **wrong})


def test_the_ladder_of_the_package():
    measured = module._measured()
    for model in ("gtr", "abc", "sgd", "ward", "ashikhmin_shirley"):
        steps = measured["models"][model]
        assert len(steps) == len(RUNGS)
        assert steps[-1]["excess"] < 1e-4, "the usual settings find the best fit"


def test_fit_within_a_tolerance(small_table):
    table = small_table[0]
    best = brdfit.fit(table, "ward")
    fit = brdfit.fit(table, "ward", tolerance=0.01)
    assert fit.converged
    assert fit.plan.tolerance == 0.01
    assert fit.effort == RUNGS[fit.plan.rung]
    assert fit.errors["log"] <= 1.01 * best.errors["log"]
    again = from_record(json.loads(json.dumps(fit.record())))
    assert again.plan == fit.plan
    assert "1" in planned(fit)
    assert planned(best) == ""


def test_a_tolerance_is_a_number(small_table):
    for wrong in ("1%", 1.0, 0):
        with pytest.raises(ValueError, match="a tolerance is a share of the error in"):
            brdfit.fit(small_table[0], "ward", tolerance=wrong)


def test_better_settings_follow_where_much_is_left_to_gain(small_table, ladder, monkeypatch):
    """A ladder that promises too much is found out by the cells."""
    table = small_table[0]
    hasty = brdfit.Effort(path="compressed", shapes=0.2, starts=1, rtol=0.9)
    monkeypatch.setattr("brdfit.fitting.fit_table.RUNGS", (hasty, *RUNGS[1:]))
    first = brdfit.fit(table, "ward", effort=hasty)
    assert first.gain > 0.5e-6, "else this test asks nothing"
    monkeypatch.setitem(LADDER["models"], "ward", [{"excess": 1e-9, "seconds": 0.1}] * 4)
    fit = brdfit.fit(table, "ward", tolerance=1e-6)
    assert fit.plan.rung > 0
    assert fit.gain < first.gain


@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("--tolerance", "much"),
        ("--tolerance", "120%"),
        ("--tolerance", "0"),
        ("--time-budget", "-5ms"),
        ("--time-budget", "2h"),
    ],
)
def test_wrong_options(small_file, tmp_path, capsys, option, value):
    assert cli.run(["fit", str(small_file), "--model", "ward", "--out", str(tmp_path / "out"), option, value]) == 2
    said = capsys.readouterr().err
    assert option in said
    assert repr(value) in said
    assert not (tmp_path / "out").exists()
