"""MERL files: the layout against a file packed by hand, the angles, what is refused, what loading costs."""

import hashlib
import struct
import subprocess
import sys
import tracemalloc
from dataclasses import replace

import brdfit
import numpy as np
import pytest
from brdfit.tables import Scattered, merl_grid, read_merl, table, write_merl

SHAPE = (3, 4, 5)


def planes(shape=SHAPE):
    return np.random.default_rng(0).random((3, *shape)) + 0.1


def packed(path, shape=SHAPE, value=lambda c, h, d, p: 1000 * c + 100 * h + 10 * d + p + 1.0):
    """A file written value by value, in the order that the database's description gives."""
    n_h, n_d, n_p = shape
    with path.open("wb") as file:
        file.write(struct.pack("<3i", *shape))
        for c in range(3):
            for h in range(n_h):
                for d in range(n_d):
                    for p in range(n_p):
                        file.write(struct.pack("<d", value(c, h, d, p)))
    return path


def test_layout_and_scale(tmp_path):
    found = read_merl(packed(tmp_path / "steel.binary"))
    assert (found.material, found.source) == ("steel", str(tmp_path / "steel.binary"))
    assert found.sha256 == hashlib.sha256((tmp_path / "steel.binary").read_bytes()).hexdigest()
    assert found.planes.shape == (3, *SHAPE)
    assert found.planes.dtype == np.float64
    assert found.planes.flags.c_contiguous
    assert found.isotropic
    assert found.mask.all()
    for c, scale in enumerate((1 / 1500, 1.15 / 1500, 1.66 / 1500)):
        # one product and one quotient, each rounded once (half an ulp, 1.1e-16), here and there
        np.testing.assert_allclose(found.planes[c, 2, 3, 4], (1000 * c + 235) * scale, rtol=4.5e-16)
    np.testing.assert_array_equal(found.values[1, 2, 3], found.planes[:, 1, 2, 3])


def test_angles_of_the_standard_grid():
    edge, centre = merl_grid(angles="edge"), merl_grid(angles="centre")
    assert edge.shape == (90, 90, 180)
    # degrees to radians: three roundings of numbers below pi
    tolerance = {"rtol": 0, "atol": 1.5e-15}
    np.testing.assert_allclose(edge.theta_h, np.radians(np.arange(90) ** 2 / 90), **tolerance)
    np.testing.assert_allclose(edge.theta_d, np.radians(np.arange(90)), **tolerance)
    np.testing.assert_allclose(edge.phi_d, np.radians(np.arange(180)), **tolerance)
    np.testing.assert_allclose(centre.theta_h, np.radians((np.arange(90) + 0.5) ** 2 / 90), **tolerance)
    np.testing.assert_allclose(centre.theta_d, np.radians(np.arange(90) + 0.5), **tolerance)
    np.testing.assert_allclose(centre.phi_d, np.radians(np.arange(180) + 0.5), **tolerance)
    for axis, last in (("theta_h", 90), ("theta_d", 90), ("phi_d", 180)):
        edges = getattr(edge, f"{axis}_edges")
        # a cell spans [i, i + 1) under both conventions
        np.testing.assert_array_equal(edges, getattr(centre, f"{axis}_edges"))
        np.testing.assert_array_equal(edges[:-1], getattr(edge, axis))
        assert edges[-1] == np.radians(last)


@pytest.mark.parametrize(
    ("shape", "given", "degrees"),
    [((3, 4, 5), None, 180), ((3, 4, 8), None, 180), ((3, 4, 16), None, 360), ((3, 4, 16), 180, 180), ((3, 4, 8), 360, 360)],
)
def test_period_of_phi(tmp_path, shape, given, degrees):
    found = brdfit.load(packed(tmp_path / "a.binary", shape), phi_period=given)
    assert found.layout.phi_d_edges[-1] == np.radians(degrees)
    assert found.layout.shape == shape


def test_convention_is_recorded(tmp_path):
    path = packed(tmp_path / "a.binary")
    assert brdfit.load(path).angles == "edge"
    found = brdfit.load(path, angles="centre")
    assert found.angles == "centre"
    np.testing.assert_array_equal(found.layout.theta_d, merl_grid(SHAPE, angles="centre").theta_d)
    assert found.seconds > 0


def test_wrong_choices(tmp_path):
    path = packed(tmp_path / "a.binary")
    with pytest.raises(ValueError, match=r"angles must be 'edge' or 'centre', not 'middle'"):
        brdfit.load(path, angles="middle")
    with pytest.raises(ValueError, match=r"phi_period must be 180 or 360 degrees, not 90"):
        brdfit.load(path, phi_period=90)


def test_what_is_not_measured_is_masked(tmp_path):
    bad = {(0, 0, 0, 0): -1.0, (1, 1, 1, 1): np.nan, (2, 2, 2, 2): np.inf, (0, 2, 3, 4): 0.0}
    path = packed(tmp_path / "a.binary", value=lambda *at: bad.get(at, 1.0))
    found = brdfit.load(path)
    expected = np.ones(SHAPE, bool)
    expected[0, 0, 0] = expected[1, 1, 1] = expected[2, 2, 2] = False
    np.testing.assert_array_equal(found.mask, expected)
    assert found.planes[0, 2, 3, 4] == 0


@pytest.mark.parametrize("order", [">f8", "<f8"])
def test_values_that_are_no_reflectance_are_refused(tmp_path, order):
    """Doubles of the other byte order have any exponent."""
    path = packed(tmp_path / "a.binary")
    raw = bytearray(path.read_bytes())
    values = np.random.default_rng(0).lognormal(size=(len(raw) - 12) // 8) * (1.0 if order == ">f8" else 1e30)
    raw[12:] = values.astype(order).tobytes()
    path.write_bytes(raw)
    with pytest.raises(brdfit.InputError, match=r"a\.binary: values up to .*/sr are no reflectance; check its byte order"):
        brdfit.load(path)


@pytest.mark.parametrize("angles", ["edge", "centre"])
def test_round_trip(tmp_path, angles):
    values = planes()
    values[1, 0, 1, 2] = -0.5
    values[2, 1, 1, 1] = np.nan
    given = table(values, merl_grid(SHAPE, angles=angles), "a", angles=angles)
    brdfit.save(given, tmp_path / "a.binary")
    found = brdfit.load(tmp_path / "a.binary", angles=angles)
    np.testing.assert_array_equal(found.mask, given.mask)
    assert found.mask.sum() == found.mask.size - 2
    # a quotient and a product by the same scale, each rounded once
    np.testing.assert_allclose(found.planes[:, found.mask], values[:, given.mask], rtol=2.3e-16)
    np.testing.assert_array_equal(found.layout.theta_h, given.layout.theta_h)
    stored = np.fromfile(tmp_path / "a.binary", "<f8", offset=12).reshape(3, *SHAPE)
    assert (stored[:, ~given.mask] == -1).all()


def test_planes_alone_can_be_written(tmp_path):
    write_merl(tmp_path / "a.binary", planes())
    assert (tmp_path / "a.binary").stat().st_size == 12 + 24 * 3 * 4 * 5
    assert list(tmp_path.iterdir()) == [tmp_path / "a.binary"]
    # as in the round trip
    np.testing.assert_allclose(read_merl(tmp_path / "a.binary").planes, planes(), rtol=2.3e-16)


def test_what_the_format_cannot_hold(tmp_path):
    path = tmp_path / "a.binary"
    layout = merl_grid(SHAPE)
    with pytest.raises(brdfit.InputError, match=r"a\.binary: a MERL table has 3 channels and this one 2; save it as \.h5"):
        brdfit.save(table(planes()[:2], layout, "a"), path)
    with pytest.raises(brdfit.InputError, match=r"a\.binary: the angles of this table are not those of the MERL grid; save"):
        brdfit.save(table(planes(), replace(layout, theta_d=layout.theta_d + 1e-3), "a"), path)
    with pytest.raises(brdfit.InputError, match=r"a\.binary: the angles of this table are not those of the MERL grid; save"):
        brdfit.save(table(planes(), merl_grid(SHAPE, phi_period=360), "a"), path)
    up = np.array([[0.0, 0.0, 1.0]])
    with pytest.raises(brdfit.InputError, match=r"a\.binary: a MERL table is an isotropic half/difference grid and this"):
        brdfit.save(table(np.ones((3, 1)), Scattered(up, up, np.ones(1)), "a"), path)
    with pytest.raises(brdfit.InputError, match=r"a\.binary: values of shape \(3, 2\) are no MERL table; give planes"):
        write_merl(path, np.ones((3, 2)))
    assert not list(tmp_path.iterdir())


def test_full_size(tmp_path):
    """A file of the database's size takes its own size in memory and a few masks, and keeps its order."""
    path = tmp_path / "full.binary"
    stored = np.arange(3 * 90 * 90 * 180, dtype="<f8")
    with path.open("wb") as file:
        file.write(struct.pack("<3i", 90, 90, 180))
        file.write(stored)
    size = path.stat().st_size
    assert size == 34_992_012
    tracemalloc.start()
    try:
        found = brdfit.load(path)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    # the planes, and at most four arrays of a byte a cell (1.5 MB each) for the mask: far below another copy of the planes
    assert peak < size + 4 * 90 * 90 * 180 + 1e6
    assert found.planes.shape == (3, 90, 90, 180)
    np.testing.assert_array_equal(found.planes[2, 89, 88], stored.reshape(3, 90, 90, 180)[2, 89, 88] * (1.66 / 1500))


def test_loading_needs_no_jax(tmp_path):
    path = packed(tmp_path / "a.binary")
    code = f"import sys, brdfit; brdfit.load({str(path)!r}); sys.exit('jax' in sys.modules or 'equinox' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
