"""What benchmarks over many tables share: their arguments, the rows that an earlier run kept, and the command they state."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any


def arguments(doc: str | None) -> argparse.Namespace:
    """``tables`` (the files that are taken), ``every``, ``keep`` and ``out``."""
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tables", type=Path)
    parser.add_argument("--every", type=int, default=1, help="take every N-th table")
    parser.add_argument("--keep", type=Path, required=True, help="what is finished, lines of JSON")
    parser.add_argument("--out", type=Path, required=True)
    args = parser.parse_args()
    args.tables = sorted(args.tables.glob("*.binary"))[:: args.every]
    return args


def rows(keep: Path) -> list[dict[str, Any]]:
    """Lines of an earlier run, if there was one."""
    return [json.loads(line) for line in keep.read_text(encoding="utf-8").splitlines()] if keep.exists() else []


def command(script: str, page: str, every: int) -> str:
    """The command that makes a page."""
    step = f" --every {every}" if every > 1 else ""
    return f"python benchmarks/{script}.py TABLES --keep {script}.jsonl --out docs/{page}.md{step}"
