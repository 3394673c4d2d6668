"""Single values of arguments: numbers, sizes, texts, and what a wrong one is called in messages."""

from __future__ import annotations

import math
import re
import reprlib
from typing import Any

import numpy as np

from organza._organza import InputError

# More than any picture, machine or film has, and exact as a number with a point.
_MOST = 2**53
# The most that scenes take.
_MOST_PIXELS = 65536
HEX_COLOR = re.compile("#[0-9a-fA-F]{6}")


def kind_of(thing: Any) -> str:
    """What a thing is, for messages."""
    if isinstance(thing, str):
        return f"the text {thing!r}"
    if isinstance(thing, np.ndarray) and thing.ndim:
        return f"an array of the shape {thing.shape}"
    # Numbers of Python say more by their value, and a library's data set by its library.
    if thing is None or isinstance(thing, (bool, int, float, list, tuple, dict, np.generic)):
        return reprlib.repr(thing)
    module = type(thing).__module__.partition(".")[0]
    return type(thing).__name__ if module in ("builtins", "numpy") else f"{module}.{type(thing).__name__}"


def number(name: str, value: Any) -> float:
    """A finite number."""
    is_number = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
    try:
        found = float(value) if is_number else math.nan
    except OverflowError:
        found = math.inf
    if not math.isfinite(found):
        raise InputError(f"{name}: expected a finite number, found {kind_of(value)}")
    return found


def place_of(name: str, value: Any) -> list[float]:
    """Three finite numbers."""
    parts = parts_of(value)
    if len(parts) != 3:
        raise InputError(f"{name}: expected three numbers, found {kind_of(value)}")
    return [number(name, part) for part in parts]


def parts_of(value: Any) -> list[Any]:
    """The parts of a list, a tuple or an array of one axis; none of anything else."""
    return list(value) if isinstance(value, (list, tuple)) or (isinstance(value, np.ndarray) and value.ndim == 1) else []


def whole(name: str, value: Any, unit: str = "") -> int | None:
    """A whole number from 1 on; None stays None. ``unit`` is what is counted, in messages."""
    if value is None:
        return None
    is_number = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
    if is_number and value > _MOST:
        raise InputError(f"{name}: expected at most {_MOST}{unit and f' {unit}'}, found {kind_of(value)}")
    if not is_number or not value >= 1 or value != int(value):
        raise InputError(f"{name}: expected a whole number{unit and f' of {unit}'} from 1 on, found {kind_of(value)}")
    return int(value)


def sides_of(size: Any) -> tuple[int, int] | None:
    """A width and a height; None stays None."""
    if size is None:
        return None
    sides = [whole("size", side) for side in parts_of(size)]
    if len(sides) != 2:
        raise InputError(f"size: expected a width and a height, found {size!r}")
    if any(side is not None and side > _MOST_PIXELS for side in sides):
        raise InputError(f"size: expected 1 to {_MOST_PIXELS} pixels a side, found {size!r}")
    return sides[0] or 1, sides[1] or 1


def flag(name: str, value: Any) -> bool:
    """True or False."""
    if not isinstance(value, (bool, np.bool_)):
        raise InputError(f"{name}: expected True or False, found {value!r}")
    return bool(value)


def text(name: str, value: Any, expected: str) -> str | None:
    """A text; None stays None. ``expected`` is what it stands for, in messages."""
    if value is not None and not isinstance(value, str):
        raise InputError(f"{name}: expected {expected}, found {kind_of(value)}")
    return value
