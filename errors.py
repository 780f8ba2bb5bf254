"""What goes wrong outside the library."""

from __future__ import annotations


class InputError(ValueError):
    """An input that cannot be used. The message is one line that names the file, the fault and what to do."""

    def __init__(self, message: str) -> None:
        super().__init__(" ".join(message.splitlines()))


__all__ = ["InputError"]
