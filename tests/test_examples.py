"""The examples, run as a user runs them, from another directory."""

import json
import subprocess
import sys
from pathlib import Path

import brdfit
import pytest

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"


@pytest.fixture
def example(tmp_path):
    def run(name):
        command = [sys.executable, str(EXAMPLES / name), "report"]
        ended = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300, check=False)
        assert ended.returncode == 0, ended.stderr
        assert ended.stdout.endswith("report: report/report.html\n")
        fits = json.loads((tmp_path / "report" / "fits.json").read_text())["fits"]
        return fits, (tmp_path / "report" / "report.html").read_text()

    return run


def test_custom_loss(example):
    (by_log, by_light), page = example("custom_loss.py")
    assert (by_log["loss"], by_light["loss"]) == ("log", "reflected_light")
    assert by_log["converged"]
    assert by_light["converged"]
    # each is the best one under the loss that it minimised
    assert by_light["errors"]["log"] > by_log["errors"]["log"]
    assert by_light["errors"]["reflected_light"] < 0.2
    assert "reflected_light" in page


def test_custom_model(example):
    (minnaert, lambert), page = example("custom_model.py")
    assert (minnaert["model"], lambert["model"]) == ("minnaert", "lambert")
    # noiseless truth is recovered to 1e-6, as for the models of the package
    assert minnaert["parameters"]["albedo"] == pytest.approx([0.4, 0.3, 0.2], rel=1e-6)
    assert minnaert["parameters"]["k"] == pytest.approx(1.3, rel=1e-6)
    assert set(minnaert["stderr"]) == set(minnaert["spread"]) == {"albedo", "k"}
    assert lambert["errors"]["log"] > 1e-3
    assert "minnaert" in page
    assert "darkening towards the limb" in page
    assert page.index("minnaert") < page.index("lambert"), "the better model ranks first"


def test_own_measurements(example, tmp_path):
    (ggx, ward), page = example("own_measurements.py")
    # the scan's noise of 2 % leaves this much undecided, by its own account
    assert abs(ggx["parameters"]["alpha"] - 0.2) < 4 * max(ggx["stderr"]["alpha"], ggx["spread"]["alpha"])
    assert ggx["errors"]["log"] < ward["errors"]["log"]
    assert brdfit.load(tmp_path / "report" / "scan.h5").channels == 3
    assert "scan" in page
