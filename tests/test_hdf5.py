"""The project's own table file gives back what was written, bit for bit."""

import hashlib
from dataclasses import fields, replace

import brdfit
import numpy as np
import pytest
from brdfit.scenes.appearance import SceneGrid
from brdfit.tables import HalfDifferenceGrid, Scattered, SphericalGrid, merl_grid, read_hdf5, read_truth, table, write_hdf5

RNG = np.random.default_rng(1)


def axis(n, top):
    edges = np.sort(RNG.random(n + 1)) * top
    return (edges[:-1] + edges[1:]) / 2, edges


def unit(n):
    v = RNG.normal(size=(n, 3))
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def half_difference(aniso):
    (th, the), (td, tde), (pd, pde) = axis(3, np.pi / 2), axis(2, np.pi / 2), axis(4, np.pi)
    ph, phe = axis(5, 2 * np.pi) if aniso else (None, None)
    return HalfDifferenceGrid(th, td, pd, the, tde, pde, ph, phe)


def spherical(aniso):
    (ti, tie), (to, toe), (po, poe) = axis(3, np.pi / 2), axis(2, np.pi / 2), axis(4, 2 * np.pi)
    pi, pie = axis(5, 2 * np.pi) if aniso else (None, None)
    return SphericalGrid(ti, to, po, tie, toe, poe, pi, pie)


LAYOUTS = {
    "merl": merl_grid((3, 2, 4)),
    "half_difference": half_difference(False),
    "half_difference_aniso": half_difference(True),
    "spherical": spherical(False),
    "spherical_aniso": spherical(True),
    "scattered": Scattered(unit(7), unit(7), RNG.random(7)),
    "scattered_isotropic": Scattered(unit(7), unit(7), RNG.random(7), isotropic=True),
}


def bits(a):
    return np.ascontiguousarray(a).view(np.uint64)


@pytest.mark.parametrize("channels", [1, 3, 5])
@pytest.mark.parametrize("layout", LAYOUTS.values(), ids=LAYOUTS.keys())
def test_round_trip(tmp_path, layout, channels):
    planes = RNG.random((channels, *layout.shape)) * 10.0 ** RNG.integers(-300, 300, (channels, *layout.shape))
    flat = planes.reshape(channels, -1)
    flat[0, :4] = -1.0, np.nan, np.inf, -0.0
    names = tuple(f"{400 + 50 * c} nm" for c in range(channels))
    given = table(planes, layout, "blue métal", source="bench.txt", angles="centre", channel_names=names)
    left_out = given.mask.copy()
    left_out.flat[5] = False  # masked for a reason that the values do not tell
    given = replace(given, mask=left_out)
    path = tmp_path / "a.h5"
    brdfit.save(given, path)
    found = brdfit.load(path)
    assert list(tmp_path.iterdir()) == [path]
    np.testing.assert_array_equal(bits(found.planes), bits(given.planes))
    np.testing.assert_array_equal(found.mask, given.mask)
    assert (found.material, found.angles, found.channel_names) == ("blue métal", "centre", names)
    assert (found.source, found.sha256) == (str(path), hashlib.sha256(path.read_bytes()).hexdigest())
    assert type(found.layout) is type(layout)
    for f in fields(layout):
        a, b = getattr(layout, f.name), getattr(found.layout, f.name)
        if isinstance(a, np.ndarray):
            np.testing.assert_array_equal(bits(a), bits(b))
        else:
            assert a == b
            assert type(a) is type(b)


def test_weights_of_a_scene_are_not_lost(tmp_path):
    grid = LAYOUTS["merl"]
    axes = {f.name: getattr(grid, f.name) for f in fields(HalfDifferenceGrid)}
    given = table(np.ones((3, *grid.shape)), SceneGrid(**axes, weight=np.ones(grid.shape)), "blue")
    with pytest.raises(brdfit.InputError, match=r"t\.h5: the format keeps no weights of a scene; save the table itself"):
        write_hdf5(tmp_path / "t.h5", given)
    assert not list(tmp_path.iterdir())


def test_same_table_same_bytes(tmp_path):
    given = table(np.ones((1, 3, 2, 4)), LAYOUTS["merl"], "a")
    brdfit.save(given, tmp_path / "a.h5")
    brdfit.save(given, tmp_path / "b.h5")
    assert (tmp_path / "a.h5").read_bytes() == (tmp_path / "b.h5").read_bytes()


def test_degrees_are_refused(tmp_path):
    grid = LAYOUTS["half_difference"]
    axes = {f.name: getattr(grid, f.name) for f in fields(HalfDifferenceGrid)}
    turned = HalfDifferenceGrid(**{n: None if a is None else np.degrees(a) for n, a in axes.items()})
    write_hdf5(tmp_path / "a.h5", table(np.ones((1, *grid.shape)), turned, "a"))
    with pytest.raises(brdfit.InputError, match=r"a\.h5: \w+ reaches [\d.]+, and angles are in radians; convert them"):
        read_hdf5(tmp_path / "a.h5")


def test_viewers_below_the_horizon_are_read(tmp_path):
    """A goniometer may go round the whole sphere: what lies below is not measured, and no degrees."""
    grid = LAYOUTS["spherical"]
    whole = replace(grid, theta_o_edges=np.array([0.0, 1.0, np.pi]))
    write_hdf5(tmp_path / "a.h5", table(np.ones((1, *grid.shape)), whole, "a"))
    np.testing.assert_array_equal(read_hdf5(tmp_path / "a.h5").layout.theta_o_edges, whole.theta_o_edges)


def test_no_channel_names(tmp_path):
    write_hdf5(tmp_path / "a.h5", table(np.ones((2, 3, 2, 4)), LAYOUTS["merl"], "a"))
    assert read_hdf5(tmp_path / "a.h5").channel_names == ()


def test_truth(tmp_path):
    given = table(np.ones((1, 3, 2, 4)), LAYOUTS["merl"], "a")
    write_hdf5(tmp_path / "a.h5", given)
    assert read_truth(tmp_path / "a.h5") is None
    diffuse = RNG.random(3)
    write_hdf5(tmp_path / "a.h5", given, truth={"model": "ward", "parameters": {"alpha": 0.1, "diffuse": diffuse}})
    truth = read_truth(tmp_path / "a.h5")
    assert truth == {"model": "ward", "parameters": {"alpha": 0.1, "diffuse": diffuse.tolist()}}
    np.testing.assert_array_equal(read_hdf5(tmp_path / "a.h5").planes, given.planes)
