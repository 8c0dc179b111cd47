"""Reports that print and show as they are."""

from __future__ import annotations

from html import escape


class Report(str):
    """A text of lines. A notebook shows it in columns, and an interpreter without quotes."""

    def __repr__(self) -> str:
        return str(self)

    def _repr_html_(self) -> str:
        return f"<pre>{escape(self)}</pre>"
