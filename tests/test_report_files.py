"""The files of a fit: the same input gives the same bytes, and broken files are said in one line."""

import json
import re
import subprocess
import sys

import pytest
from brdfit.errors import InputError
from brdfit.reports.evidence import load_evidence, save_evidence
from brdfit.reports.gather import gather
from brdfit.reports.write import read_fits, rebuild_report, report, write_fits, write_report

from .report_cases import ENVIRONMENT, Reader


def test_same_input_same_bytes(tmp_path, measured, fits, evidence, report):
    once_more = gather(measured, fits)
    assert write_report(tmp_path, fits, [once_more], ENVIRONMENT).read_text() == report
    other = write_report(tmp_path, fits, [once_more], {"when": "another day"}).read_text()
    cut = re.compile(r'<section id="environment">.*?</section>', re.S)
    assert cut.sub("", other) == cut.sub("", report)
    assert other != report
    first = save_evidence(tmp_path, [evidence]).read_bytes()
    assert save_evidence(tmp_path, [once_more]).read_bytes() == first


REBUILD = """
import sys
{before}
import numpy as np
options = np.get_printoptions()
from brdfit.reports import rebuild_report
rebuild_report(sys.argv[1])
assert "colour" in sys.modules
assert np.get_printoptions() == options, np.get_printoptions()
"""


def test_page_is_the_same_whatever_was_imported_or_set_before(tmp_path, fits, evidence):
    write_fits(tmp_path, fits, ENVIRONMENT)
    save_evidence(tmp_path, [evidence])
    pages = []
    for before in ("", "import colour", "import numpy as np; np.set_printoptions(precision=3, suppress=True)"):
        subprocess.run([sys.executable, "-c", REBUILD.format(before=before), tmp_path], check=True)
        pages.append((tmp_path / "report.html").read_bytes())
    assert pages[1] == pages[0]
    assert pages[2] == pages[0]


def test_nothing_is_left_beside_the_files(tmp_path, fits, evidence):
    write_fits(tmp_path, fits, ENVIRONMENT)
    save_evidence(tmp_path, [evidence])
    write_report(tmp_path, fits, [evidence], ENVIRONMENT)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["evidence.h5", "fits.json", "report.html"]


def test_rebuild_from_files_shows_the_same(tmp_path, fits, evidence, report):
    write_fits(tmp_path, fits, ENVIRONMENT)
    save_evidence(tmp_path, [evidence])
    rebuilt = rebuild_report(tmp_path).read_text()
    assert Reader(rebuilt).text == Reader(report).text


def test_fits_json_is_the_contract(tmp_path, fits):
    path = write_fits(tmp_path, fits, ENVIRONMENT)
    document = json.loads(path.read_text())
    assert {k: document[k] for k in ("format", "version", "environment")} == {
        "format": "brdfit-fits",
        "version": 1,
        "environment": ENVIRONMENT,
    }
    assert document["fits"] == [f.record() for f in fits]
    back, environment = read_fits(tmp_path)
    assert environment == ENVIRONMENT
    assert [f.record() for f in back] == document["fits"]


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        (None, "no such file"),
        ("", "is empty"),
        ("{", "is not JSON"),
        ("[]", "is not a brdfit fits file"),
        ('{"format": "brdfit-fits", "version": 2}', "has version 2, this brdfit reads 1"),
        ('{"format": "brdfit-fits", "version": 1}', "holds no list of fits"),
        ('{"format": "brdfit-fits", "version": 1, "fits": [{}]}', "fit 0 has no 'parameters'"),
        ('{"format": "brdfit-fits", "version": 1, "fits": [3]}', "fit 0 cannot be read"),
    ],
)
def test_broken_fits_json_is_one_line(tmp_path, text, fault):
    if text is not None:
        (tmp_path / "fits.json").write_text(text)
    with pytest.raises(InputError) as caught:
        read_fits(tmp_path)
    assert fault in str(caught.value)
    assert "fits.json" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_broken_evidence_is_one_line(tmp_path):
    (tmp_path / "evidence.h5").write_bytes(b"not HDF5 at all")
    with pytest.raises(InputError, match="cannot be read as evidence of a fit"):
        load_evidence(tmp_path)


def test_report_in_one_call(tmp_path, measured, fits):
    path = report(tmp_path / "new" / "folder", fits, measured)
    read, where = read_fits(path.parent)
    assert [f.model_name for f in read] == [f.model_name for f in fits]
    assert where["jax"]
    assert len(load_evidence(path.parent)) == 1
    alone = report(tmp_path / "alone", fits[0], [measured]).read_text()
    assert fits[0].model_name in alone
    with pytest.raises(ValueError, match="no table given for the fit of"):
        report(tmp_path / "none", fits, [])
    with pytest.raises(ValueError, match="two tables have the same material"):
        report(tmp_path / "none", fits, [measured, measured])
    assert not (tmp_path / "none").exists()
