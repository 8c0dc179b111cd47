"""Progress of long work: a callback, or a bar."""

from __future__ import annotations

import sys
import time
from contextlib import contextmanager
from typing import Any, Callable, Iterator, Optional, Union

Report = Callable[[str, float], object]
Progress = Union[None, bool, Report]

#: Seconds between two lines where there is no bar.
INTERVAL = 10.0


@contextmanager
def reporter(progress: Progress) -> Iterator[Optional[Report]]:
    """Yields what is called with the present work and the share of it that is done; `None` for nothing.

    progress: a callable; `False` for nothing; `True` for a bar; `None` for a bar in a notebook or on a terminal.
    """
    if callable(progress):
        yield progress
        return
    if progress is None:
        progress = _in_notebook() or sys.stderr.isatty()
    if not progress:
        yield None
        return
    bar = _bar()
    try:
        yield bar
    finally:
        bar.close()


def _in_notebook() -> bool:
    shell = sys.modules.get("IPython")
    if shell is None:
        return False
    running = shell.get_ipython()
    return running is not None and type(running).__name__ == "ZMQInteractiveShell"


def _bar() -> Union[_Bar, _Lines]:
    try:
        from tqdm.auto import tqdm
    except ImportError:
        return _Lines()
    return _Bar(tqdm)


class _Bar:
    """A bar of tqdm."""

    def __init__(self, tqdm: Any) -> None:
        form = "{desc} {percentage:3.0f}%|{bar}| {remaining} left"
        self._bar = tqdm(total=1.0, bar_format=form, leave=False)

    def __call__(self, work: str, share: float) -> None:
        self._bar.set_description_str(work, refresh=False)
        self._bar.n = share
        self._bar.refresh()

    def close(self) -> None:
        self._bar.close()


class _Lines:
    """A line on standard error from time to time."""

    def __init__(self) -> None:
        self._began = self._last = time.monotonic()

    def __call__(self, work: str, share: float) -> None:
        now = time.monotonic()
        if now - self._last >= INTERVAL:
            self._last = now
            print(f"progress: {now - self._began:.0f} s, {100 * share:.0f}%: {work}", file=sys.stderr)

    def close(self) -> None:
        """Lines stay."""
