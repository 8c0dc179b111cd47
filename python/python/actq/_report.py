"""Reports that print and show as they are."""

from __future__ import annotations

import os
from html import escape
from typing import Union

from . import _actq


class Report(str):
    """A text of lines. A notebook shows it in columns, and an interpreter without quotes."""

    def __repr__(self) -> str:
        return str(self)

    def _repr_html_(self) -> str:
        return f"<pre>{escape(self)}</pre>"


class Page(str):
    """A report as an HTML file, in which the image runs. A notebook shows it."""

    def save(self, path: Union[str, "os.PathLike[str]"]) -> None:
        """Writes the file, whole or not at all. A symbolic link stays, and its target is written.

        Raises `actq.Error` if the file cannot be written.
        """
        _actq.write_text(path, self)

    def __repr__(self) -> str:
        return f"Page({len(self)} characters)"

    def _repr_html_(self) -> str:
        return f'<iframe sandbox="allow-scripts" srcdoc="{escape(self)}" title="actq report" style="width:100%;height:720px;border:0"></iframe>'
