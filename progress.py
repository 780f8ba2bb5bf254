"""Progress of long work: a bar on a terminal, plain lines otherwise, nothing when silent."""

from __future__ import annotations

import sys
from types import TracebackType


class Progress:
    """Counts finished pieces on standard error."""

    def __init__(self, total: int, silent: bool = False) -> None:
        self.total = total
        self.silent = silent
        self.done = 0
        self._bar = None
        if not silent and sys.stderr.isatty():
            from rich.console import Console
            from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn
            from rich.progress import Progress as Bar

            columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
            self._bar = Bar(*columns, console=Console(stderr=True), transient=True)

    def __enter__(self) -> Progress:
        if self._bar is not None:
            self._bar.start()
            self._task = self._bar.add_task("", total=self.total)
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None) -> None:
        if self._bar is not None:
            self._bar.stop()

    def say(self, text: str) -> None:
        """What is being done now."""
        if self._bar is not None:
            self._bar.update(self._task, description=text)

    def advance(self, text: str) -> None:
        """One piece is finished; ``text`` says how it went."""
        self.done += 1
        if self._bar is not None:
            self._bar.console.print(text, highlight=False)
            self._bar.advance(self._task)
        elif not self.silent:
            print(f"[{self.done}/{self.total}] {text}", file=sys.stderr, flush=True)


__all__ = ["Progress"]
