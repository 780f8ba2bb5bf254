"""Scene files: what they mean, and every fault by file, line and key; images of light in files."""

from pathlib import Path

import numpy as np
import pytest
from brdfit.errors import InputError
from brdfit.scenes import load_scene
from brdfit.scenes.images import read_image, write_exr
from brdfit.scenes.scene import Ambient, Area, Directional, Environment, Frustum, Plane, Point, Sphere

EXAMPLES = Path(__file__).resolve().parents[1] / "examples" / "scenes"

GOOD = """\
name = "test"
exposure = 2.0
budget = 50

[shape]
kind = "cone"
radius = 0.5

[camera]
kind = "perspective"
from = [0, 0, 5]
field = 20
pixels = [30, 20]

[[light]]
kind = "directional"
direction = [0, 1, 1]
irradiance = 3

[[light]]
kind = "point"
position = [1, 2, 3]
intensity = [1, 2, 3]

[tolerance]
measure = "psnr"
"""

FAULTS = {
    'kind = "cone"': ('kind = "cube"', "line 6: shape kind must be one of sphere, plane, cylinder, cone, not 'cube'"),
    "radius = 0.5": ("radius = 0", "line 7: shape radius must be a number above 0, not 0"),
    "from = [0, 0, 5]": ("from = [0, 5]", "line 11: camera from must be three numbers, [x, y, z], not [0, 5]"),
    "field = 20": ("field = 200", "line 12: camera field must be a number between 0 and 180, not 200"),
    "pixels = [30, 20]": ("pixels = [30, 0]", "line 13: camera pixels must be two whole numbers from 1 to 4096"),
    "irradiance = 3\n": ("radiance = 3\n", "line 15: light 1 misses the key 'irradiance': a number or [red, green, blue]"),
    "position = [1, 2, 3]": ("position = [1, nan, 3]", "line 22: light 2 position must be three numbers"),
    "intensity = [1, 2, 3]": (
        "intensity = -1",
        "line 23: light 2 intensity must be a number or [red, green, blue], none neg",
    ),
    'measure = "psnr"': (
        'measure = "mse"',
        "line 26: tolerance measure must be one of itp, ciede2000, psnr, ssim, relative",
    ),
    "budget = 50": ("buget = 50", "line 3: buget is not known here; known: budget, camera, exposure, light, name, samples"),
    "exposure = 2.0": ('exposure = "bright"', "line 2: exposure must be a number above 0, not 'bright'"),
    "direction = [0, 1, 1]": (
        "direction = [0, 0, 0]",
        "line 17: light 1 direction must be three numbers, [x, y, z], not all 0",
    ),
    "[shape]": ("[shapes]", "line 1: the file misses the table [shape]"),
    "[camera]": ("[camera", "is not TOML: "),
}


def test_a_scene_is_what_its_file_says(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(GOOD)
    scene = load_scene(path)
    assert scene.name == "test"
    assert scene.shape == Frustum(height=2.0, bottom=0.5, top=0.0)
    assert scene.camera.field == 20
    assert scene.camera.width is None
    assert scene.lights == (Directional((0, 1, 1), (3, 3, 3)), Point((1, 2, 3), (1, 2, 3)))
    assert (scene.exposure, scene.budget) == (2.0, 50.0)
    assert (scene.tolerance.measure, scene.tolerance.limit) == ("psnr", 38.0)
    assert scene.tolerance.met(40)
    assert not scene.tolerance.met(30)


@pytest.mark.parametrize("part", FAULTS)
def test_faults_are_named(tmp_path, part):
    changed, words = FAULTS[part]
    assert part in GOOD
    path = tmp_path / "scene.toml"
    path.write_text(GOOD.replace(part, changed, 1))
    with pytest.raises(InputError) as fault:
        load_scene(path)
    message = str(fault.value)
    assert message.startswith(str(path))
    assert words in message
    assert "\n" not in message


def test_faults_of_files(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        load_scene(tmp_path / "none.toml")
    (tmp_path / "raw.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(InputError, match="is not text"):
        load_scene(tmp_path / "raw.toml")
    light = '[[light]]\nkind = "environment"\nimage = "gone.exr"\n'
    (tmp_path / "scene.toml").write_text(GOOD + light)
    with pytest.raises(InputError, match=r"scene.toml, line 29: light 3 image cannot be used: .*gone.exr: no such file"):
        load_scene(tmp_path / "scene.toml")
    (tmp_path / "none.toml").write_text(GOOD.replace("from = [0, 0, 5]", "from = [0, 5, 0]"))
    with pytest.raises(InputError, match="line 9: camera up must not lie along the view"):
        load_scene(tmp_path / "none.toml")


def test_examples():
    scenes = {p.stem: load_scene(p) for p in sorted(EXAMPLES.glob("*.toml"))}
    assert set(scenes) >= {"frontal", "grazing", "environment"}
    assert isinstance(scenes["frontal"].shape, Sphere)
    assert isinstance(scenes["grazing"].shape, Plane)
    assert {type(light) for light in scenes["grazing"].lights} == {Point, Ambient}
    assert {type(light) for light in scenes["environment"].lights} == {Environment, Area}


def test_images_come_back(tmp_path):
    """Half precision keeps 11 bits."""
    pytest.importorskip("OpenImageIO", reason="images of light need OpenImageIO, an optional dependency")
    picture = np.random.default_rng(0).random((3, 5, 3)) * 100
    write_exr(tmp_path / "a.exr", {"one": picture})
    np.testing.assert_allclose(read_image(tmp_path / "a.exr"), picture, rtol=2**-11)
    (tmp_path / "b.hdr").write_text("nothing")
    with pytest.raises(InputError, match="is not an image"):
        read_image(tmp_path / "b.hdr")
    write_exr(tmp_path / "black.exr", {"one": 0 * picture})
    with pytest.raises(InputError, match="black everywhere"):
        read_image(tmp_path / "black.exr")
