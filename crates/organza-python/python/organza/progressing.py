"""Progress of long calls: a function, a bar of tqdm, or lines."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from organza._organza import InputError
from organza.values import kind_of

Progress = Callable[[str, float], object]

# How a bar of tqdm looks.
_FORMAT = "{desc}: {percentage:3.0f}%|{bar}| {elapsed}"
# Lines without tqdm: one for each such share of a stage.
_SHARE_OF_A_LINE = 0.1


def check_progress(progress: Any) -> None:
    """Refuses what hears no progress."""
    if progress is None or isinstance(progress, (bool, np.bool_)) or callable(progress) or _is_bar(progress):
        return
    raise InputError(f"progress: expected a function of a stage and a share, a bar of tqdm, or True, found {kind_of(progress)}")


@contextmanager
def heard(progress: Any) -> Iterator[Progress | None]:
    """What the extension calls meanwhile: a function as it is; of True a bar of tqdm, or lines on stderr where that is not installed; of a class of bars one
    of these; a bar that the caller made stays the caller's."""
    check_progress(progress)
    if progress is None or (isinstance(progress, (bool, np.bool_)) and not progress):
        yield None
    elif isinstance(progress, (bool, np.bool_)):
        try:
            tqdm: Any = importlib.import_module("tqdm.auto")
        except ImportError:
            yield _lines()
            return
        with tqdm.tqdm(total=1.0, bar_format=_FORMAT, leave=False) as made:
            yield _moving(made)
    elif isinstance(progress, type) and _is_bar(progress):
        with progress(total=1.0, bar_format=_FORMAT, leave=False) as made:
            yield _moving(made)
    elif _is_bar(progress):
        yield _moving(progress)
    else:
        yield progress


def _is_bar(progress: Any) -> bool:
    """Whether it has what a bar of tqdm has, or a class of such bars."""
    return hasattr(progress, "update") and hasattr(progress, "set_description")


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
