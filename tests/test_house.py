"""The house: what is packaged, how long files are, and that the documents say what the project does."""

import importlib
import inspect
import re
import subprocess
import sys
import tomllib
from importlib.metadata import version
from pathlib import Path

import brdfit
import pytest

ROOT = Path(__file__).resolve().parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
LONGEST = 500
"""Lines of a Python file: beyond it, it holds more than one idea."""


def test_every_package_is_listed():
    skipped = {"build", "dist", "tests"}
    found = {
        ".".join(("brdfit", *path.parent.relative_to(ROOT).parts))
        for path in ROOT.rglob("__init__.py")
        if not any(part in skipped or part.startswith(".") for part in path.relative_to(ROOT).parts)
    }
    listed = PROJECT["tool"]["setuptools"]["packages"]
    assert set(listed) == found
    assert listed == sorted(listed)


def test_data_files_are_packaged():
    data = PROJECT["tool"]["setuptools"]["package-data"]
    for package in PROJECT["tool"]["setuptools"]["packages"]:
        folder = ROOT.joinpath(*package.split(".")[1:])
        if folder == ROOT:
            continue
        files = {p for p in folder.iterdir() if p.is_file() and p.suffix not in (".py", ".pyc")}
        assert files == {p for pattern in data.get(package, []) for p in folder.glob(pattern)}, package


@pytest.mark.parametrize("folder", ["brdfit", *PROJECT["tool"]["setuptools"]["packages"][1:]])
def test_public_names_exist(folder):
    module = importlib.import_module(folder)
    for name in getattr(module, "__all__", []):
        getattr(module, name)


NAMES = """
import re, sys
from functools import reduce
import brdfit
for name in sys.argv[1:]:
    reduce(getattr, name.split(".")[1:], brdfit)
"""


def test_names_in_documents_exist_after_one_import():
    """As they are written, in a fresh interpreter; and type checkers know all that is public."""
    texts = [p.read_text() for p in _tracked() if p.suffix == ".md"]
    texts += [inspect.getdoc(getattr(brdfit, name)) or "" for name in brdfit.__all__]
    names = {n for text in texts for n in re.findall(r"\bbrdfit(?:\.[a-zA-Z_]\w*)+", text)}
    names -= {n for n in names if n.rsplit(".")[-1] in ("binary", "h5", "toml")}
    subprocess.run([sys.executable, "-c", NAMES, *sorted(names)], check=True)
    known = set(re.findall(r"import (\w+) as \1", (ROOT / "__init__.py").read_text()))
    assert known == set(brdfit.__all__) - {"__version__"}


def test_version_is_said_once():
    assert brdfit.__version__ == PROJECT["project"]["version"] == version("brdfit")
    assert f"## [{brdfit.__version__}]" in (ROOT / "CHANGELOG.md").read_text()


def test_files_hold_one_idea():
    files = [p for p in _tracked() if p.suffix == ".py"]
    long = {str(p.relative_to(ROOT)): n for p in files if (n := len(p.read_text().splitlines())) > LONGEST}
    assert not long


def test_no_table_is_committed():
    assert not [p for p in _tracked() if p.suffix in (".binary", ".h5", ".exr", ".bsdf")]


def test_readme_commands_are_single_lines_and_ci_runs_the_second():
    blocks = re.findall(r"```sh\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
    main_job, tests = blocks[:2]
    assert main_job.count("\n") == tests.count("\n") == 1
    assert "pytest" in tests
    assert tests in (ROOT / ".ci" / "run").read_text()


def test_documents_link_to_files_that_exist():
    documents = [p for p in _tracked() if p.suffix == ".md"]
    for document in documents:
        for target in re.findall(r"\]\(([^)#]+)[^)]*\)", document.read_text()):
            if not target.startswith("http"):
                assert (document.parent / target).exists(), f"{document.name} links to {target}"


def _tracked():
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=False)
    if listed.returncode:
        pytest.skip("needs a git checkout")
    return [path for name in listed.stdout.split("\0") if name and (path := ROOT / name).exists()]
