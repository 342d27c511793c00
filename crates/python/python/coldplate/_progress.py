"""How far long work has come."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any, Optional, Union

Callback = Callable[[str, Optional[int], Optional[int]], Any]
Progress = Union[bool, None, Callback]


def _bar(what: str, done: int | None, total: int | None) -> None:
    if total:
        filled = 30 * done // total
        text = f"[{'#' * filled}{'.' * (30 - filled)}] {done}/{total} {what}"
    else:
        text = what
    end = "\n" if total and done == total else ""
    print(f"\r{text[:100]:<100}", end=end, file=sys.stderr, flush=True)


def callback(progress: Progress) -> Callback | None:
    """A callable as it is, a bar on standard error for True, nothing for False and None."""
    if callable(progress):
        return progress
    return _bar if progress else None
