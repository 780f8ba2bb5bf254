"""The command line: what it writes, what it prints, and how it ends."""

import json
import signal
import subprocess
import sys
from pathlib import Path

import brdfit
import pytest
from brdfit import cli
from brdfit.fitting import LOSSES, batch
from brdfit.models import MODELS, parameters_of
from brdfit.reports import read_fits


def program(*args, **options):
    command = [sys.executable, "-m", "brdfit", *map(str, args)]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, check=False, **options)


def run(*args):
    return cli.run([str(a) for a in args])


@pytest.fixture(scope="module")
def fitted(small_file, tmp_path_factory):
    out = tmp_path_factory.mktemp("fitted") / "deep" / "report"
    return out, program("fit", small_file, "--model", "ward,lambert", "--out", out)


# ---- fit


def test_fit_writes_both_files_and_says_where(fitted):
    out, ended = fitted
    assert ended.returncode == 0, ended.stderr
    assert ended.stdout == f"report: {out / 'report.html'}\n"
    assert {p.name for p in out.iterdir()} == {"fits.json", "report.html", "evidence.h5"}


def test_without_a_terminal_progress_is_plain_lines(fitted):
    lines = fitted[1].stderr.splitlines()
    assert [line[:5] for line in lines] == ["[1/2]", "[2/2]"]
    assert all("stuff" in line and "perceptual" in line and "compiling" in line for line in lines)


def test_fits_json_holds_the_truth_in_the_order_of_the_models(fitted, small_table):
    document = json.loads((fitted[0] / "fits.json").read_text())
    assert (document["format"], document["version"]) == ("brdfit-fits", 1)
    assert {"brdfit", "jax", "python", "device", "precision", "when"} <= set(document["environment"])
    ward, lambert = document["fits"]
    assert (ward["model"], lambert["model"]) == ("ward", "lambert")
    for name, true in small_table[1]["parameters"].items():
        assert ward["parameters"][name] == pytest.approx(true, rel=1e-6), name  # recovery as the project promises it
    assert ward["cells"]["total"] == 24 * 12 * 12
    brdfit.model("ward", **ward["parameters"])


def test_report_rebuilds_to_the_same_bytes(fitted, capsys):
    page = fitted[0] / "report.html"
    before = page.read_bytes()
    page.unlink()
    assert run("report", fitted[0]) == 0
    assert capsys.readouterr().out == f"report: {page}\n"
    assert page.read_bytes() == before


def test_json_prints_the_file_and_nothing_else(small_file, tmp_path, capfd):
    assert run("fit", small_file, "--model", "lambert", "--out", tmp_path, "--json", "--no-report") == 0
    printed = capfd.readouterr()
    assert printed.out == (tmp_path / "fits.json").read_text()
    assert printed.err == ""
    assert [p.name for p in tmp_path.iterdir()] == ["fits.json"]


def test_quiet_prints_nothing(small_file, tmp_path, capfd):
    assert run("fit", small_file, "--model", "lambert", "--out", tmp_path, "--quiet", "--no-report") == 0
    assert capfd.readouterr() == ("", "")


def test_options_reach_the_fit(small_file, tmp_path):
    options = ["--loss", "ngan", "--measure", "cells", "--angles", "centre", "--max-angle", "60"]
    assert run("fit", small_file, "--model", "lambert", "--out", tmp_path, "--quiet", "--no-report", *options) == 0
    (fit,), _ = read_fits(tmp_path)
    assert (fit.loss, fit.measure, fit.angles, fit.max_angle) == ("ngan", "cells", "centre", 60)


def test_two_files_of_one_name_stay_apart(small_file, small_table, tmp_path):
    other = tmp_path / "other" / "stuff.h5"
    other.parent.mkdir()
    brdfit.save(small_table[0], other)
    assert run("fit", small_file, other, small_file, "--model", "lambert", "--out", tmp_path / "out", "--quiet") == 0
    fits, _ = read_fits(tmp_path / "out")
    assert [f.source for f in fits] == [str(small_file), str(other)], "a file named twice is fitted once"
    page = (tmp_path / "out" / "report.html").read_text()
    assert page.count('<section class="material"') == 2
    for f in fits:
        assert f"{Path(f.source).name} (SHA-256 {f.sha256[:12]}" in page


def test_a_failed_fit_is_a_row_and_exit_code_1(small_file, tmp_path, monkeypatch, capfd):
    def fit(table, model, **options):
        if model == "ward":
            raise FloatingPointError("out of luck")
        return brdfit.fit(table, model, **options)

    monkeypatch.setattr(batch, "fit", fit)
    assert run("fit", small_file, "--model", "ward,lambert", "--out", tmp_path) == 1
    ward, lambert = read_fits(tmp_path)[0]
    assert not ward.converged
    assert "out of luck" in ward.reason
    assert lambert.converged
    assert "FAILED: FloatingPointError: out of luck" in capfd.readouterr().err
    assert "out of luck" in (tmp_path / "report.html").read_text()


def test_an_interrupted_run_keeps_what_was_finished(small_file, tmp_path):
    files = [tmp_path / f"stuff{k:02d}.binary" for k in range(60)]
    for path in files:
        path.hardlink_to(small_file)
    out = tmp_path / "out"
    # a shell starts background jobs with interrupts ignored, and children inherit that
    listen = (
        "import signal; signal.signal(signal.SIGINT, signal.default_int_handler); from brdfit import __main__ as m; m.main()"
    )
    command = [sys.executable, "-c", listen, "fit", *map(str, files), "--model", "lambert", "--out", str(out)]
    with subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as running:
        assert running.stderr.readline().startswith("[1/60]")
        running.send_signal(signal.SIGINT)
        _, said = running.communicate(timeout=120)
    assert running.returncode == 1
    assert said.splitlines()[-1] == "brdfit: interrupted; what was finished is kept"
    assert 1 <= len(read_fits(out)[0]) < 60
    assert {p.name for p in out.iterdir()} == {"fits.json", "report.html", "evidence.h5"}


# ---- the other verbs


def test_synth_writes_tables_and_their_truth(tmp_path, capsys):
    assert run("synth", "lambert-like-nothing", "--out", tmp_path / "never") == 2
    assert not (tmp_path / "never").exists()
    capsys.readouterr()
    assert run("synth", "ward-00", "--noise", "0.01", "--seed", "7", "--out", tmp_path / "tables") == 0
    paths = [Path(line) for line in capsys.readouterr().out.splitlines()]
    assert {p.name for p in paths} == {"ward-00.binary", "ward-00.h5", "ward-00.json"}
    truth = json.loads((tmp_path / "tables" / "ward-00.json").read_text())
    assert (truth["model"], truth["seed"]) == ("ward", 7)
    table = brdfit.load(tmp_path / "tables" / "ward-00.binary")
    assert table.layout.shape == (90, 90, 180)


def test_synth_lists_names(capsys):
    assert run("synth", "--list") == 0
    assert {"gtr-00", "abc-nickel", "misfit-coated"} <= set(capsys.readouterr().out.split())


def test_models_lists_those_named(capsys):
    assert run("models", "body+lobe", "ward") == 0
    out = capsys.readouterr().out
    assert [line for line in out.splitlines() if line and line[0] != " "] == ["body+lobe", "ward", "ward (anisotropic)"]
    assert ":class:" not in out
    assert run("models", "wart") == 2
    assert "unknown model 'wart'" in capsys.readouterr().err


def test_models_lists_everything(capsys):
    assert run("models") == 0
    text = capsys.readouterr().out
    assert run("models", "--json") == 0
    listed = json.loads(capsys.readouterr().out)
    assert [m["name"] for m in listed["models"]] == [name for name, forms in MODELS.items() for _ in forms]
    assert [loss["name"] for loss in listed["losses"]] == list(LOSSES)
    for entry, cls in zip(listed["models"], [c for forms in MODELS.values() for c in forms], strict=True):
        assert [p["name"] for p in entry["parameters"]] == [p.name for p in parameters_of(cls)]
        assert entry["references"], cls
        assert all(reference in text for reference in entry["references"])


@pytest.mark.parametrize("form", [[sys.executable, "-m", "brdfit"], [str(Path(sys.executable).with_name("brdfit"))]])
def test_both_forms_name_the_version(form):
    ended = subprocess.run([*form, "--version"], capture_output=True, text=True, check=True)
    assert ended.stdout == f"brdfit, version {brdfit.__version__}\n"


# ---- wrong use


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ("", "brdfit: Missing command. (see brdfit --help)"),
        ("paint", "brdfit: No such command 'paint'. (see brdfit --help)"),
        ("fit --out new", "brdfit fit: Missing argument 'FILE...'."),
        ("fit FILE", "brdfit fit: Missing option '--out'."),
        ("fit FILE nope.binary --out new", "brdfit: nope.binary: no such file; check the path"),
        ("fit FILE --out new --model ward,minnaert", "brdfit fit: unknown model 'minnaert': choose from gtr, abc, sgd,"),
        ("fit FILE --out new --model ,", "brdfit fit: --model names no model"),
        ("fit FILE --out new --loss l2", "brdfit fit: unknown loss 'l2': choose from log, low, bieron,"),
        ("fit FILE --out new --measure area", "brdfit fit: Invalid value for '--measure': 'area' is not one of"),
        ("fit FILE --out new --angles corner", "brdfit fit: Invalid value for '--angles': 'corner' is not one of"),
        ("fit FILE --out new --max-angle 90", "brdfit fit: Invalid value for '--max-angle': 90.0 is not in the range"),
        ("fit FILE --out new --max-angle nan", "brdfit fit: Invalid value for '--max-angle': nan is not a number"),
        ("fit FILE --out new --seed -1", "brdfit fit: Invalid value for '--seed': -1 is not in the range"),
        ("fit FILE --out FILE", ": nothing can be written there (File exists); choose another directory"),
        ("fit FILE --out FILE/new", ": nothing can be written there (Not a directory); choose another directory"),
        ("synth ward-00", "brdfit synth: Missing option '--out'."),
        ("synth ward-99 --out new", "brdfit: no synthetic material 'ward-99': did you mean ward-"),
        ("synth ward-00 --out new --noise inf", "brdfit synth: Invalid value for '--noise': inf is not a number"),
        ("synth ward-00 --out FILE", ": nothing can be written there (File exists); choose another directory"),
        ("report new", "brdfit: new/fits.json: no such file; check the path"),
    ],
)
def test_wrong_use_is_one_line_and_exit_code_2(arguments, said, small_file, tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    assert run(*(a.replace("FILE", str(small_file)) for a in arguments.split())) == 2
    printed = capfd.readouterr()
    assert said in printed.err
    assert printed.err.count("\n") == 1
    assert printed.out == ""
    assert list(tmp_path.iterdir()) == [], "nothing is written"


def test_a_bad_file_ends_the_program_before_anything_is_fitted(small_file, tmp_path):
    (tmp_path / "broken.binary").write_bytes(b"\x5a\x00\x00\x00")
    ended = program("fit", small_file, "broken.binary", "--out", "new", cwd=tmp_path)
    assert ended.returncode == 2
    assert ended.stderr.startswith("brdfit: broken.binary: is cut short")
    assert ended.stderr.count("\n") == 1
    assert [p.name for p in tmp_path.iterdir()] == ["broken.binary"]


@pytest.mark.parametrize("arguments", [["--help"], ["fit", "nope.binary", "--out", "new"]], ids=["help", "bad file"])
def test_help_and_complaints_do_not_wait_for_jax(arguments, tmp_path):
    command = [sys.executable, "-X", "importtime", "-m", "brdfit", *arguments]
    ended = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=False)
    modules = {line.rpartition("|")[2].strip() for line in ended.stderr.splitlines()}
    assert "brdfit.cli" in modules
    assert not modules & {"jax", "matplotlib", "colour"}
