"""The files of a fit: fits.json, and report.html made from it and from evidence.h5."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

from ..errors import InputError
from ..files import StrPath, folder, reading, replacing
from .beside import rendered
from .evidence import Evidence, load_evidence
from .page import page

if TYPE_CHECKING:
    from ..fitting.result import Fit
    from ..tables import Table

FITS = "fits.json"
REPORT = "report.html"
FORMAT = "brdfit-fits"
VERSION = 1


def write_fits(out_dir: StrPath, fits: Sequence[Fit], environment: dict[str, Any]) -> Path:
    """Write DIR/fits.json. All that says when and where is in ``environment``; the rest follows from the input."""
    head = json.dumps({"format": FORMAT, "version": VERSION, "environment": environment}, indent=1, ensure_ascii=False)
    entries = ",\n".join(_entry(f) for f in fits)
    return _write(Path(out_dir) / FITS, f'{head[:-2]},\n "fits": [\n{entries}\n ]\n}}\n')


_entries: WeakKeyDictionary[Fit, str] = WeakKeyDictionary()


def _entry(f: Fit) -> str:
    """A fit as JSON, made once: the file is written anew after every fit."""
    if f not in _entries:
        _entries[f] = json.dumps(f.record(), indent=1, ensure_ascii=False, allow_nan=False)
    return _entries[f]


def read_fits(out_dir: StrPath) -> tuple[list[Fit], dict[str, Any]]:
    """The fits of DIR/fits.json and the environment that they were made in.

    Raises InputError in one line if the file is missing, broken, or of another format or version.
    """
    from ..fitting.result import from_record

    path = Path(out_dir) / FITS
    with reading(path) as file:
        raw = file.read()
    try:
        document = json.loads(raw)
    except ValueError as fault:
        raise InputError(f"{path}: is not JSON ({fault}); fit again") from None
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise InputError(
            f"{path}: is not a brdfit fits file (its format is not {FORMAT!r}); name a directory that brdfit wrote"
        )
    if document.get("version") != VERSION:
        raise InputError(
            f"{path}: has version {document.get('version')!r}, this brdfit reads {VERSION}; update brdfit or fit again"
        )
    entries = document.get("fits")
    if not isinstance(entries, list):
        raise InputError(f"{path}: holds no list of fits; fit again")
    fits = []
    for k, entry in enumerate(entries):
        try:
            fits.append(from_record(entry))
        except KeyError as fault:
            raise InputError(f"{path}: fit {k} has no {fault}; fit again") from None
        except (TypeError, ValueError, AttributeError) as fault:
            raise InputError(f"{path}: fit {k} cannot be read ({fault}); fit again") from None
    environment = document.get("environment")
    return fits, environment if isinstance(environment, dict) else {}


def write_report(out_dir: StrPath, fits: Sequence[Fit], evidence: Sequence[Evidence], environment: dict[str, Any]) -> Path:
    """Write DIR/report.html: one file that needs no other and no network. The same input gives the same bytes."""
    html = rendered(Path(__file__).parent / "page.html.j2", page(fits, evidence, environment))
    return _write(Path(out_dir) / REPORT, html)


def report(out_dir: StrPath, fits: Fit | Sequence[Fit], tables: Table | Sequence[Table]) -> Path:
    """Write fits of some tables as DIR/fits.json and DIR/report.html, as the command line does; DIR is made if need be.

    Returns the path of the report. Raises ValueError if a fit is of none of the tables, or if two of them have the same
    material and source; InputError if nothing can be written there.
    """
    from ..environment import environment
    from ..fitting.result import Fit
    from .evidence import save_evidence
    from .gather import gather

    fits = [fits] if isinstance(fits, Fit) else list(fits)
    tables = tables if isinstance(tables, Sequence) else [tables]
    known = {(t.material, t.source): t for t in tables}
    if len(known) < len(tables):
        raise ValueError("two tables have the same material and source: give each a material of its own")
    for f in fits:
        if (f.material, f.source) not in known:
            raise ValueError(f"no table given for the fit of {f.model_name} to {f.material} ({f.source or 'no source'})")
    out = folder(out_dir)
    evidence, where = [gather(t, [f for f in fits if (f.material, f.source) == k]) for k, t in known.items()], environment()
    write_fits(out, fits, where)
    save_evidence(out, evidence)
    return write_report(out, fits, evidence, where)


def rebuild_report(out_dir: StrPath) -> Path:
    """Write DIR/report.html again from DIR/fits.json and, where it is there, DIR/evidence.h5."""
    fits, environment = read_fits(out_dir)
    return write_report(out_dir, fits, load_evidence(out_dir), environment)


def _write(path: Path, text: str) -> Path:
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return path


__all__ = ["read_fits", "rebuild_report", "report", "write_fits", "write_report"]
