"""Layouts: the measure of their cells against closed values, and which cells of a table count."""

import mpmath as mp
import numpy as np
import pytest
from brdfit.angles import unit_vectors
from brdfit.tables import HalfDifferenceGrid, Scattered, SphericalGrid, measurements, merl_grid, table

QUARTER, HALF, FULL = np.pi / 2, np.pi, 2 * np.pi


def edges(n, top):
    """Uneven edges from 0 to exactly ``top``."""
    e = np.concatenate([[0], np.cumsum(np.random.default_rng(n).random(n) + 0.1)])
    e *= top / e[-1]
    e[-1] = top
    return e


def middle(e):
    return (e[1:] + e[:-1]) / 2


def half_difference(phi_d=HALF, phi_h=None):
    axes = [edges(7, QUARTER), edges(5, QUARTER), edges(6, phi_d)]
    last = (None, None) if phi_h is None else (middle(edges(4, phi_h)), edges(4, phi_h))
    return HalfDifferenceGrid(*map(middle, axes), *axes, *last)


def spherical(phi_o=FULL, phi_i=None):
    axes = [edges(7, QUARTER), edges(5, QUARTER), edges(6, phi_o)]
    last = (None, None) if phi_i is None else (middle(edges(4, phi_i)), edges(4, phi_i))
    return SphericalGrid(*map(middle, axes), *axes, *last)


# All pairs of directions on two whole spheres measure (4 pi)^2. theta_d in [0, 90 deg] with phi_d in [0, 2 pi) about every h
# reaches each pair once; h above the horizon is half of them, and phi_d in [0, pi] half again, as phi_d + pi swaps l and v.
# Two hemispheres measure (2 pi)^2.
TOTALS = {
    "phi_d 180": (half_difference(), (4 * np.pi) ** 2 / 4),
    "phi_d 360": (half_difference(FULL), (4 * np.pi) ** 2 / 2),
    "anisotropic": (half_difference(HALF, FULL), (4 * np.pi) ** 2 / 4),
    "anisotropic, half of phi_h": (half_difference(HALF, HALF), (4 * np.pi) ** 2 / 8),
    "MERL": (merl_grid(), (4 * np.pi) ** 2 / 4),
    "MERL 360": (merl_grid((90, 90, 360)), (4 * np.pi) ** 2 / 2),
    "spherical": (spherical(), (2 * np.pi) ** 2),
    "spherical, half of phi_o": (spherical(HALF), (2 * np.pi) ** 2 / 2),
    "spherical, anisotropic": (spherical(FULL, FULL), (2 * np.pi) ** 2),
}


@pytest.mark.parametrize(("layout", "total"), TOTALS.values(), ids=TOTALS.keys())
def test_cells_add_up(layout, total):
    cells = np.broadcast_to(layout.solid_angle(), layout.shape)
    assert (cells > 0).all()
    # differences of cosines telescope: half an ulp (1e-16) of 1 a cell of an axis, 90 cells
    np.testing.assert_allclose(cells.sum(), total, rtol=1e-14)


def test_half_of_the_pairs_are_above_the_horizon():
    """Of the pairs whose h is up, those with both directions up measure (2 pi)^2, or half of it with reciprocity."""
    grid = merl_grid(angles="centre")
    ci, co = grid.polar_cosines()
    above = (ci > 0) & (co > 0)
    # A cell across the horizon counts whole or not at all, as its centre says: an error of second order in the width of a
    # cell, a degree.
    np.testing.assert_allclose((grid.solid_angle() * above).sum(), 2 * np.pi**2, rtol=(np.pi / 180) ** 2)


@pytest.mark.parametrize("cell", [(0, 0, 0), (0, 3, 2), (6, 4, 5), (3, 2, 1)])
def test_a_cell_is_integrated(cell):
    grid = half_difference(FULL, FULL)
    (h0, h1), (d0, d1), (p0, p1) = (
        getattr(grid, f"{n}_edges")[i : i + 2] for n, i in zip(("theta_h", "theta_d", "phi_d"), cell, strict=True)
    )
    integral = mp.quad(lambda h, d: 4 * mp.cos(d) * mp.sin(h) * mp.sin(d), [h0, h1], [d0, d1]) * (p1 - p0)
    found = grid.solid_angle()[:, *cell]
    # 1 - cos of the smallest cell (0.06 rad) loses three digits of 1e-16
    np.testing.assert_allclose(found, np.diff(grid.phi_h_edges) * float(integral), rtol=1e-13)


def test_layouts_agree_on_directions():
    """A grid's polar cosines are the z components of its directions, and these are unit vectors."""
    for layout, _ in TOTALS.values():
        if layout.shape[0] == 90:
            continue
        wi, wo = layout.directions()
        assert wi.shape == wo.shape == (*layout.shape, 3)
        # rounding of squares that add up to 1: a few ulps
        np.testing.assert_allclose(np.linalg.norm(wi, axis=-1), 1, rtol=1e-15)
        np.testing.assert_allclose(np.linalg.norm(wo, axis=-1), 1, rtol=1e-15)
        if isinstance(layout, HalfDifferenceGrid):
            ci, co = layout.polar_cosines()
            np.testing.assert_array_equal(np.broadcast_to(ci, layout.shape), wi[..., 2])
            np.testing.assert_array_equal(np.broadcast_to(co, layout.shape), wo[..., 2])


def test_spherical_directions():
    grid = spherical(FULL, FULL)
    wi, wo = grid.directions()
    q, i, o, p = 3, 2, 4, 5
    ti, to, po, pi = grid.theta_i[i], grid.theta_o[o], grid.phi_o[p], grid.phi_i[q]
    # components of unit vectors: three roundings
    np.testing.assert_allclose(wi[q, i, o, p], [np.sin(ti) * np.cos(pi), np.sin(ti) * np.sin(pi), np.cos(ti)], atol=4e-16)
    np.testing.assert_allclose(wo[q, i, o, p], [np.sin(to) * np.cos(po), np.sin(to) * np.sin(po), np.cos(to)], atol=4e-16)
    wi, _ = spherical().directions()
    assert (wi[..., 1] == 0).all()


def test_only_measured_values_pass_the_mask():
    grid = half_difference()
    planes = np.ones((3, *grid.shape))
    planes[0, 0, 0, 0] = -1e-300
    planes[1, 1, 0, 0] = np.nan
    planes[2, 2, 0, 0] = np.inf
    planes[0, 3, 0, 0] = -np.inf
    planes[:, 4, 0, 0] = 0.0
    found = table(planes, grid, "a")
    expected = np.ones(grid.shape, bool)
    expected[:4, 0, 0] = False
    np.testing.assert_array_equal(found.mask, expected)
    # a negative value stays what it is: nothing turns it into a zero that a fit would believe
    assert found.values[0, 0, 0, 0] == -1e-300
    assert not found.within(QUARTER)[~expected].any()


def test_values_are_a_view():
    grid = half_difference()
    found = table(np.ones((5, *grid.shape)), grid, "a")
    assert found.values.shape == (*grid.shape, 5)
    assert found.values.base is found.planes
    assert found.channels == 5
    assert found.isotropic


@pytest.mark.parametrize("shape", [(7, 5, 6), (3, 7, 5), (3, 7, 5, 7)])
def test_values_that_do_not_fit(shape):
    with pytest.raises(ValueError, match=r"steel: values of shape \(.*\) do not fit channels x \(7, 5, 6\)"):
        table(np.ones(shape), half_difference(), "steel")


def test_within_leaves_out_the_limit_itself():
    grid = merl_grid()
    found = table(np.ones((1, *grid.shape)), grid, "a").within(np.radians(80))
    # at theta_h = 0 both polar angles are theta_d = j degrees
    np.testing.assert_array_equal(found[0, :, 0], np.arange(90) < 80)
    # at theta_d = 0 both are theta_h = i^2/90 degrees
    np.testing.assert_array_equal(found[:, 0, 0], np.arange(90) ** 2 / 90 < 80)


def test_within_leaves_out_what_is_below_the_horizon():
    grid = merl_grid((30, 30, 60), angles="centre")
    found = table(np.ones((1, *grid.shape)), grid, "a").within(QUARTER)
    wi, wo = grid.directions()
    np.testing.assert_array_equal(found, (wi[..., 2] > 0) & (wo[..., 2] > 0))
    assert 0 < found.sum() < found.size


def test_within_on_other_layouts():
    grid = spherical()
    found = table(np.ones((1, *grid.shape)), grid, "a").within(1.0)
    expected = (grid.theta_i <= 1.0)[:, None, None] & (grid.theta_o <= 1.0)[:, None] & np.ones(grid.shape, bool)
    np.testing.assert_array_equal(found, expected)
    theta = np.radians([0.0, 79.9, 80.1, 95.0])
    v = np.stack([np.sin(theta), 0 * theta, np.cos(theta)], -1)
    up = np.tile([0.0, 0.0, 1.0], (4, 1))
    for wi, wo in ((v, up), (up, v)):
        found = table(np.ones((1, 4)), Scattered(wi, wo, np.ones(4)), "a").within(np.radians(80))
        np.testing.assert_array_equal(found, [True, True, False, False])


UP = np.tile([0.0, 0.0, 1.0], (4, 1))


def test_measurements_become_a_table():
    tilted = unit_vectors(np.radians([0, 30, 60, 90]), np.radians(40))
    found = measurements(UP, tilted * 1.0005, [[1, 2], [3, 4], [np.nan, 5], [-1, 6]], channel_names=("a", "b"))
    assert (found.channels, found.isotropic, found.material) == (2, True, "measurements")
    np.testing.assert_array_equal(found.mask, [True, True, False, False])
    np.testing.assert_array_equal(found.values[1], [3, 4])
    # scaled to length 1: the rounding of a division
    np.testing.assert_allclose(np.linalg.norm(found.layout.wo, axis=-1), 1, rtol=4e-16)
    np.testing.assert_array_equal(np.unique(found.layout.solid_angle()), [1.0])
    assert measurements(UP, UP, np.ones(4), measure=np.arange(4)).channels == 1


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"wi": UP[:3]}, r"wi must have shape \(4, 3\)"),
        ({"wo": 2 * UP}, "wo must be unit vectors: number 0 .* of length 2"),
        ({"wi": UP * np.nan}, "wi must be unit vectors"),
        ({"values": np.ones((2, 2, 2))}, "values must have shape"),
        ({"values": []}, "values must have shape"),
        ({"measure": [1, 2, 3]}, r"wo \(4, 3\) and measure \(3,\) are not \[n, 3\], \[n, 3\] and \[n\]"),
        ({"measure": [1, 2, 3, -1]}, "measure must be finite numbers, not negative and not all 0"),
        ({"measure": np.zeros(4)}, "measure must be finite numbers, not negative and not all 0"),
        ({"channel_names": ("a", "b")}, "2 channel names for 1"),
    ],
)
def test_measurements_that_do_not_agree(wrong, says):
    given = {"wi": UP, "wo": UP, "values": np.ones(4)} | wrong
    with pytest.raises(ValueError, match=says):
        measurements(given.pop("wi"), given.pop("wo"), given.pop("values"), **given)


@pytest.mark.parametrize("measure", [np.zeros(4), -np.ones(4), np.array([1, 1, np.nan, 1])])
def test_scattered_samples_count_for_what_they_say(measure):
    with pytest.raises(ValueError, match="measure must be finite numbers, not negative and not all 0"):
        Scattered(UP, UP, measure)


def test_scattered_directions_are_unit_vectors():
    for wrong in (2 * UP, UP * np.nan):
        with pytest.raises(ValueError, match="wo must be unit vectors"):
            Scattered(UP, wrong, np.ones(4))
    for shapes in ((UP, UP[:2], np.ones(4)), (UP, UP, np.ones(3)), (UP[0], UP, np.ones(4)), (UP, UP, np.ones(()))):
        with pytest.raises(ValueError, match=r"are not \[n, 3\], \[n, 3\] and \[n\]"):
            Scattered(*shapes)
