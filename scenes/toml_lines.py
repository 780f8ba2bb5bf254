"""Where in a TOML file a key stands, which the standard library's reader does not say."""

from __future__ import annotations

import re
from collections import Counter

_HEADER = re.compile(r"^\s*(\[\[?)\s*([\w.\-]+)\s*\]\]?\s*(?:#.*)?$")
_KEY = re.compile(r"""^\s*["']?([\w\-]+)["']?\s*=""")


class Lines:
    """Line numbers by path: ``("camera", "width")``, ``("light", 1, "radius")``, or the path of a table for its header."""

    def __init__(self, text: str) -> None:
        self._lines: dict[tuple[str | int, ...], int] = {}
        count: Counter[str] = Counter()
        table: tuple[str | int, ...] = ()
        for number, line in enumerate(text.splitlines(), 1):
            if header := _HEADER.match(line):
                name = header[2]
                table = (name, count[name]) if header[1] == "[[" else tuple(name.split("."))
                count[name] += 1
                self._lines.setdefault(table, number)
            elif key := _KEY.match(line):
                self._lines.setdefault((*table, key[1]), number)

    def __call__(self, path: tuple[str | int, ...]) -> int:
        """Line of a path, or of the closest thing around it."""
        while path and path not in self._lines:
            path = path[:-1]
        return self._lines.get(path, 1)


__all__ = ["Lines"]
