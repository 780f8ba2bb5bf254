"""What the plots of a report are drawn from, and what its fits are held against."""

from dataclasses import replace

import brdfit
import numpy as np
from brdfit.data import source
from brdfit.reports.evidence import load_evidence, save_evidence
from brdfit.reports.gather import _cells, gather, interpolate
from brdfit.reports.published_fits import published
from brdfit.reports.write import write_report
from brdfit.tables import Scattered, SphericalGrid, merl_grid, table

from .report_cases import GGX, WARD, Reader, fit_of, table_of


def spherical():
    polar, azimuth = np.radians(np.linspace(0, 85, 18)), np.radians(np.arange(0, 360, 30.0))
    edges = np.radians(np.append(np.append(0, np.linspace(2.5, 82.5, 17)), 87.5))
    return SphericalGrid(polar, polar, azimuth, edges, edges, np.radians(np.arange(-15, 360, 30.0)))


def scattered():
    rng = np.random.default_rng(7)
    v = rng.normal(size=(2, 500, 3))
    v[..., 2] = np.abs(v[..., 2])
    v /= np.linalg.norm(v, axis=-1, keepdims=True)
    return Scattered(v[0], v[1], np.full(500, 1e-2), isotropic=True)


def test_tables_on_other_grids(tmp_path):
    fit = fit_of("ward", WARD, 0.01)
    grid = gather(table_of(fit.model, spherical()), [fit])
    assert "nearest to the plane of incidence" in grid.lobes.how
    # where the table holds the model's own values, its lobes are the model's
    known = np.isfinite(grid.lobes.measured)
    assert known.mean() > 0.9
    np.testing.assert_allclose(grid.lobes.measured[known], grid.lobes.fitted[0][known], rtol=1e-9)
    loose = gather(table_of(fit.model, scattered()), [fit])
    assert loose.lobes is None
    assert np.nanmax(np.abs(loose.maps.signed)) < 1e-9
    text = Reader(write_report(tmp_path, [fit], [loose], {}).read_text()).text
    assert "No lobe plots: lobes need values in planes of incidence" in text
    assert "only the fits are shown" in text


def test_residual_of_the_truth_vanishes(evidence, measured):
    assert evidence.maps.signed.shape[0] == 3
    assert np.nanmax(np.abs(evidence.maps.rms[1])) < 1e-12  # gtr made the table
    assert np.nanmax(evidence.maps.rms[0]) > 0.05  # ward did not
    assert np.isnan(evidence.maps.signed[2]).all()  # sgd failed


def test_maps_show_the_cells_that_are_fitted():
    grid = merl_grid()
    zero = table(np.zeros((1, *grid.shape)), grid, "black")
    used = _cells(zero, 80.0)[3]
    # of cells at the limit itself, a row of this grid, rounding would let some in
    assert used.sum() == zero.within(np.radians(80.0))[:, ::2, ::15].sum()


def test_interpolation_is_exact_at_the_cells_and_never_reads_a_masked_one(measured):
    wi, wo = (d.reshape(-1, 3) for d in measured.layout.directions())
    got = interpolate(measured, wi, wo)
    known = measured.mask.ravel()
    np.testing.assert_allclose(got[known], measured.values.reshape(-1, 3)[known], rtol=1e-6)
    assert np.isnan(got[~known]).all()
    assert not (got < 0).any()


def test_lobes_follow_the_table_between_its_cells(evidence):
    inside = np.abs(evidence.lobes.theta_o) < 70
    m, f = evidence.lobes.measured[inside], evidence.lobes.fitted[1][inside]
    assert np.isfinite(m).mean() > 0.85
    # a grid of 18 x 15 x 12 cells: linear interpolation is good to a tenth of the value, at the median
    assert np.nanmedian(np.abs(m - f) / f) < 0.1
    k = int(np.argmin(np.abs(evidence.lobes.theta_i - 30)))
    peak = evidence.lobes.theta_o[k, np.argmax(evidence.lobes.fitted[1, k, :, 0])]
    assert 25 < peak < 40  # on the mirror side, a little beyond the mirror direction


def test_masked_pixels_are_counted_not_black(measured, fits):
    hole = np.array(measured.planes)
    hole[:, 6:9] = -1
    with_hole = gather(table(hole, measured.layout, "stuff"), fits)
    unknown = np.isnan(with_hole.sphere.measured).any(-1)
    assert unknown.sum() > 500
    assert np.isnan(with_hole.sphere.difference[:, unknown]).all()


def test_evidence_survives_its_file(tmp_path, evidence):
    save_evidence(tmp_path, [evidence])
    (back,) = load_evidence(tmp_path)
    assert back.keys == evidence.keys
    assert back.lobes.how == evidence.lobes.how
    assert isinstance(back.sphere.exposure, float)
    np.testing.assert_allclose(back.albedo.fitted, evidence.albedo.fitted, rtol=1e-6)


def test_published_fit_beside_the_new_one(tmp_path, measured):
    """A table that Ngan's Ward lobe of nickel is the truth of: it errs by nothing there, and gtr has no published fit."""
    layout = measured.layout
    nickel = table_of(brdfit.preset("ngan_ward", "nickel"), layout, "nickel")
    fits = [fit_of("ward", WARD, 0.0333, "nickel"), fit_of("gtr", GGX, 0.0456, "nickel")]
    evidence = gather(nickel, fits)
    save_evidence(tmp_path, [evidence])
    (back,) = load_evidence(tmp_path)
    assert back.published == evidence.published
    ((key, found),) = evidence.published.items()
    assert key == evidence.keys[0]
    assert found.source == source("ngan_ward")
    assert max(found.errors.values()) < 1e-12
    text = Reader(write_report(tmp_path, fits, [evidence], {}).read_text()).text
    assert text.count("beside the published fit") == 1
    assert "this fit 0.0167 0.0333 published fit" in text
    assert f"Published fit: {source('ngan_ward')}." in text
    assert "[published fit of nickel]" in text


def test_no_published_fit(measured):
    """Of another material, or for another number of channels, there is nothing beside the new fit."""
    fit, nickel = fit_of("ward", WARD, 0.0333), replace(measured, material="nickel")
    assert published(measured, [fit]) == [None]
    assert published(replace(nickel, planes=measured.planes[:1]), [fit]) == [None]
    assert published(nickel, [replace(fit, model=None)]) == [None]
    assert published(nickel, [fit]) != [None]
