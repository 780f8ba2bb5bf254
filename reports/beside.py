"""Pages from templates, and a page and its numbers side by side: what the commands beside ``fit`` write."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from ..files import StrPath, replacing


def rendered(template: Path, context: dict[str, Any]) -> str:
    """The text of a Jinja ``template``, which may use those of reports; in HTML, values are escaped."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined, select_autoescape

    templates = Environment(
        loader=FileSystemLoader([template.parent, Path(__file__).parent]),
        autoescape=select_autoescape(["html.j2"]),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return templates.get_template(template.name).render(context)


def write_beside(
    out_dir: StrPath, template: Path, context: dict[str, Any], names: tuple[str, str], numbers: dict[str, Any]
) -> Path:
    """Write the page of a Jinja ``template``, which may use those of reports, and ``numbers`` as JSON, each replaced whole.

    ``names`` are those of page and numbers in ``out_dir``. Returns the path of the page.
    Raises InputError if a file cannot be written.
    """
    html = rendered(template, context)
    text = json.dumps(numbers, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
    out = Path(out_dir)
    for name, content in ((names[1], text), (names[0], html)):
        with replacing(out / name) as temporary:
            temporary.write_text(content, encoding="utf-8")
    return out / names[0]


__all__ = ["rendered", "write_beside"]
