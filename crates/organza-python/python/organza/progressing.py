"""Progress of long calls: a function, a bar of tqdm, or lines."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from organza._organza import InputError

Progress = Callable[[str, float], object]

# Lines without tqdm: one for each such share of a stage.
_SHARE_OF_A_LINE = 0.1


@contextmanager
def heard(progress: Any) -> Iterator[Progress | None]:
    """What the extension calls meanwhile: a function as it is; of True a bar of tqdm, or lines on stderr where that is not installed; a bar that the caller
    made stays the caller's."""
    if progress is None or progress is False:
        yield None
    elif progress is True:
        try:
            tqdm: Any = importlib.import_module("tqdm.auto")
        except ImportError:
            yield _lines()
            return
        with tqdm.tqdm(total=1.0, bar_format="{desc}: {percentage:3.0f}%|{bar}| {elapsed}", leave=False) as made:
            yield _moving(made)
    elif hasattr(progress, "update") and hasattr(progress, "set_description"):
        yield _moving(progress)
    elif callable(progress):
        yield progress
    else:
        raise InputError(f"progress: expected a function of a stage and a share, a bar of tqdm, or True, found {progress!r}")


def _moving(bar: Any) -> Progress:
    """Moves a bar of tqdm, whatever its total is."""
    total = 1.0 if bar.total is None else float(bar.total)

    def move(stage: str, share: float) -> None:
        bar.set_description(stage, refresh=False)
        bar.update(max(share * total - bar.n, 0.0))

    return move


def _lines() -> Progress:
    """Writes a line for each stage, and for each tenth of the work."""
    last: tuple[str, int] = ("", -1)

    def write(stage: str, share: float) -> None:
        nonlocal last
        part = (stage, int(share / _SHARE_OF_A_LINE))
        if part != last:
            last = part
            print(f"{stage}: {100.0 * share:.0f} %", file=sys.stderr)

    return write
