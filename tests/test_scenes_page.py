"""brdfit scene from the command to its files, on a small table and with two effects to choose from."""

import json
from types import SimpleNamespace

import brdfit
import numpy as np
import pytest
from brdfit.angles import directions
from brdfit.cli import run
from brdfit.models.effects import EFFECTS
from brdfit.scenes import page

from .report_cases import Reader

SCENE = """\
[shape]
kind = "sphere"
[camera]
kind = "orthographic"
from = [0, 0, 5]
pixels = [24, 24]
[[light]]
kind = "directional"
direction = [0.2, 0.3, 1]
irradiance = 3
[tolerance]
limit = {limit}
"""


@pytest.fixture
def two_effects(monkeypatch):
    """A search over thirteen effects compiles for a minute."""
    few = {n: EFFECTS[n] for n in ("body", "lobe")}
    monkeypatch.setattr("brdfit.scenes.survey.EFFECTS", few)
    monkeypatch.setattr("brdfit.scenes.choose.EFFECTS", few)


def test_scene_command(tmp_path, small_file, two_effects, capsys):
    scene = tmp_path / "mine.toml"
    scene.write_text(SCENE.format(limit=15))
    assert run(["scene", str(scene), str(small_file), "--out", str(tmp_path), "--quiet"]) == 0
    assert capsys.readouterr().out == ""
    found = json.loads((tmp_path / "scene.json").read_text())
    assert (found["format"], found["scene"], found["met"]) == ("brdfit-scene", "mine", True)
    assert found["chosen"]["effects"] == found["ladder"][-1]["effects"]
    assert found["chosen"]["error"] == pytest.approx(found["chosen"]["errors"]["itp"])
    assert found["chosen"]["error"] <= 15
    assert {e["effect"] for e in found["effects"]} == {"body", "lobe"}
    page = Reader((tmp_path / "scene.html").read_text())
    assert not page.open
    assert found["summary"] in page.text
    pictures = [a for tag, a in page.tags if tag == "img"]
    assert len(pictures) == 7  # three pictures, two differences, their colours, and the map
    assert all(p["src"].startswith("data:image/png") and p["alt"] for p in pictures)


def test_no_set_meets_the_tolerance(tmp_path, small_file, two_effects):
    """A Ward material in a GGX lobe: something is left, and the exit code and the page say so."""
    scene = tmp_path / "mine.toml"
    scene.write_text(SCENE.format(limit=0.001))
    assert run(["scene", str(scene), str(small_file), "--out", str(tmp_path), "--quiet"]) == 1
    found = json.loads((tmp_path / "scene.json").read_text())
    assert not found["met"]
    assert found["summary"].startswith("No set of effects meets the tolerance")
    assert "of the squared difference" in found["summary"]


def test_wrong_scene(tmp_path, small_file, capsys):
    scene = tmp_path / "mine.toml"
    scene.write_text(SCENE.format(limit=3).replace("irradiance", "brightness"))
    out = tmp_path / "out"
    assert run(["scene", str(scene), str(small_file), "--out", str(out)]) == 2
    assert "mine.toml, line 7: light 1 misses the key 'irradiance'" in capsys.readouterr().err
    assert not out.exists()


def test_fit_under_a_scene(tmp_path, small_file):
    scene = tmp_path / "mine.toml"
    scene.write_text(SCENE.format(limit=3))
    arguments = ["fit", str(small_file), "--model", "ward", "--scene", str(scene), "--out", str(tmp_path)]
    assert run([*arguments, "--no-report", "--quiet"]) == 0
    found = json.loads((tmp_path / "fits.json").read_text())["fits"][0]
    assert found["measure"] == "scene mine"
    assert run([*arguments, "--measure", "cells"]) == 2


def test_rounding_is_printed_as_zero():
    small = brdfit.model("gtr", diffuse=[6.8e-16, 0.2, 1e-9], specular=[1e-14, 0.3, 0.5], alpha=1e-13, gamma=2.0)
    shown = dict(page._parameters(small))
    assert shown["diffuse"] == "0 0.2000 1.000·10⁻⁹"
    assert shown["specular"] == "0 0.3000 0.5000"
    assert shown["alpha"] == "1.000·10⁻¹³"  # there is no lobe of width 0


def test_one_angle_is_no_range():
    turn = np.radians([[1.0, 8.9], [2.0, 8.9], [3.0, 8.9]])
    wi, wo = directions(turn[:, 0], turn[:, 1], np.radians(90.0))
    study = SimpleNamespace(seen=SimpleNamespace(wi=wi, wo=wo, weight=np.ones(3)))
    assert page._angles(study) == "θh from 1.0 to 3.0 degrees and θd at 8.9 degrees"
