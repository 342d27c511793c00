"""Small tables as text and as HTML."""

from __future__ import annotations

import html
from collections.abc import Sequence
from typing import Any

Rows = "tuple[Sequence[str], Sequence[Sequence[Any]]]"


def _cell(value: Any) -> str:
    return f"{value:.5g}" if isinstance(value, float) else "" if value is None else str(value)


def as_text(head: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """Columns under their headings; numbers stand to the right.

    >>> print(as_text(["sensor", "degC"], [("motor", 50.2857), ("plate", 21.0)]))
    sensor    degC
    motor   50.286
    plate       21
    """
    cells = [list(head), *([_cell(value) for value in row] for row in rows)]
    right = [any(isinstance(value, (int, float)) for value in values) for values in zip(*rows)] or [False] * len(head)
    widths = [max(map(len, texts)) for texts in zip(*cells)]
    line = lambda texts: "  ".join(text.rjust(width) if to else text.ljust(width) for text, width, to in zip(texts, widths, right))
    return "\n".join(line(texts).rstrip() for texts in cells)


def as_html(head: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """A table of HTML."""
    line = lambda tag, texts: "<tr>" + "".join(f"<{tag}>{html.escape(text)}</{tag}>" for text in texts) + "</tr>"
    return f"<table>{line('th', head)}{''.join(line('td', [_cell(value) for value in row]) for row in rows)}</table>"


class Page(str):
    """A page of HTML. A notebook shows it in a frame."""

    def _repr_html_(self) -> str:
        return f'<iframe srcdoc="{html.escape(self)}" title="page" style="width: 100%; height: 50rem; border: 0"></iframe>'
