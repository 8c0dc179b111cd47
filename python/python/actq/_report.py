"""Reports that print and show as they are."""

from __future__ import annotations

import os
import tempfile
from html import escape
from pathlib import Path
from typing import Union


class Report(str):
    """A text of lines. A notebook shows it in columns, and an interpreter without quotes."""

    def __repr__(self) -> str:
        return str(self)

    def _repr_html_(self) -> str:
        return f"<pre>{escape(self)}</pre>"


class Page(str):
    """A report as an HTML file, in which the image runs. A notebook shows it."""

    def save(self, path: Union[str, "os.PathLike[str]"]) -> None:
        """Writes the file, whole or not at all."""
        place = Path(path)
        handle, part = tempfile.mkstemp(dir=place.parent, prefix=f".{place.name}", suffix=".part")
        try:
            with os.fdopen(handle, "w", encoding="utf-8", newline="") as file:
                file.write(self)
            os.chmod(part, 0o644)
            os.replace(part, place)
        except BaseException:
            os.unlink(part)
            raise

    def __repr__(self) -> str:
        return f"Page({len(self)} characters)"

    def _repr_html_(self) -> str:
        return f'<iframe sandbox="allow-scripts" srcdoc="{escape(self)}" title="actq report" style="width:100%;height:720px;border:0"></iframe>'
