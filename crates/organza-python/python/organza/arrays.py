"""Arguments as the extension takes them: arrays, colours, images, numbers."""

from __future__ import annotations

import math
import numbers
import os
from collections.abc import Mapping
from typing import Any

import numpy as np

from organza._organza import Data, InputError
from organza.transfers import Transfer
from organza.values import HEX_COLOR, kind_of, parts_of

# The largest number of a byte.
_MOST_OF_A_BYTE = 255
# Times white that a colour may be before most such colours are taken for bytes.
_BRIGHTEST = 16
# Whole numbers up to this one are exact in single precision.
_MOST_EXACT = 2**24
# Bytes of the longest float that the extension takes.
_LONGEST_FLOAT = 8


def array_of(thing: Any, name: str) -> Any:
    """An array of a kind of numbers that the extension takes; None stays None. ``name`` is the argument in messages."""
    if thing is None:
        return None
    if isinstance(thing, np.ma.MaskedArray) and np.ma.is_masked(thing) and thing.dtype.kind in "biuf":
        # A gap, as NaN is.
        thing = np.where(np.ma.getmaskarray(thing), np.nan, thing.data)
    expected = f"{name}: expected an array of numbers"
    if isinstance(thing, str):
        raise InputError(f"{expected}, found the text {thing!r}")
    try:
        array = np.asarray(thing)
    except ValueError as error:
        raise InputError(f"{expected}, found {_ragged(thing) or error}") from None
    if array.dtype.kind == "O":
        return _of_objects(array, thing, expected)
    if array.dtype.kind not in "biuf":
        raise InputError(f"{expected}, found {_no_numbers(array)}")
    if array.dtype.kind == "f" and array.dtype.itemsize > _LONGEST_FLOAT:
        return array.astype(np.float64)
    if array.dtype in (np.float16, np.bool_) or array.dtype.byteorder not in ("=", "|"):
        return array.astype(np.uint8 if array.dtype == np.bool_ else array.dtype.newbyteorder("=").char.replace("e", "f"))
    return array


def _ragged(thing: Any) -> str | None:
    """The first row of nested lists whose length differs from that of the first one, in words; None where there is no such row."""
    rows = list(thing) if isinstance(thing, (list, tuple)) else []
    sizes = [len(row) if hasattr(row, "__len__") and not isinstance(row, str) else None for row in rows]
    for row, size in enumerate(sizes):
        if size != sizes[0]:
            first, other = ("no list" if count is None else f"{count} numbers" if count != 1 else "1 number" for count in (sizes[0], size))
            return f"rows of other lengths: {first} in row 0, {other} in row {row}"
    return next((said for said in map(_ragged, rows) if said is not None), None)


def _of_objects(array: np.ndarray, thing: Any, expected: str) -> np.ndarray:
    """Numbers that are objects of Python, as tables of mixed columns have them, in which None is a gap."""
    if array.ndim == 0:
        raise InputError(f"{expected}, found {kind_of(thing)}")
    for place, part in enumerate(array.flat):
        if part is not None and not isinstance(part, numbers.Real):
            index = ", ".join(str(int(step)) for step in np.unravel_index(place, array.shape))
            raise InputError(f"{expected}, found objects of Python, of which that at [{index}] is {part!r}")
    try:
        return array.astype(np.float64)
    except OverflowError:
        raise InputError(f"{expected}, found one that is larger than any of double precision") from None


def _no_numbers(array: np.ndarray) -> str:
    """What an array holds in the place of numbers, and what makes numbers of it."""
    first = array.flat[0] if array.size else None
    if array.dtype.kind in "USaT":
        return f"texts, of which the first is {str(first)!r}; `array.astype(float)` makes numbers of such as have them"
    if array.dtype.kind == "c":
        return f"complex ones ({array.dtype}); give `abs(array)`, `array.real` or `array.imag`"
    if array.dtype.kind == "M":
        return f"times ({array.dtype}); `(times - times.min()) / np.timedelta64(1, 's')` are their seconds"
    if array.dtype.kind == "m":
        return f"spans of time ({array.dtype}); `spans / np.timedelta64(1, 's')` are their seconds"
    if array.dtype.names:
        return f"one of the fields {', '.join(array.dtype.names)}; `array[{array.dtype.names[0]!r}]` is one of them"
    return f"one of type {array.dtype}"


def colors_of(thing: Any, name: str = "colors") -> Any:
    """Colours as the extension takes them: linear numbers with a point, or whole ones of sRGB of one byte or two."""
    array = array_of(thing, name)
    if array is not None and np.issubdtype(array.dtype, np.floating) and array.size:
        # Radiance may lie above 1, a few times white; most numbers of a picture of bytes do, up to 255.
        bright = np.count_nonzero(array > 1.0)
        if 2 * bright > array.size and _BRIGHTEST < np.nanmax(array) <= _MOST_OF_A_BYTE:
            found = f"{array.dtype} up to {float(np.nanmax(array)):g}, of which {bright} of {array.size} lie above 1"
            raise InputError(f"{name}: expected linear numbers, 1 for white, found {found}; bytes of sRGB are `.astype(np.uint8)`")
    if array is None or not np.issubdtype(array.dtype, np.integer) or array.dtype in (np.uint8, np.uint16) or not array.size:
        return array
    low, high = (int(end) for end in (array.min(), array.max()))
    if low < 0 or high > _MOST_OF_A_BYTE:
        found = f"{array.dtype} from {low} to {high}"
        raise InputError(f"{name}: expected linear numbers with a point, bytes of sRGB from 0 to {_MOST_OF_A_BYTE}, or uint16 of sRGB, found {found}")
    # 0 and 1 are no bytes that anybody means: they are the ends of linear numbers.
    return array.astype(np.float32 if high <= 1 else np.uint8)


def is_told_apart(values: Any) -> bool:
    """Whether single precision, in which volumes and the values of points are kept, has 256 steps or more between the least and the largest value."""
    if values.dtype.kind not in "iuf" or values.dtype.itemsize <= (4 if values.dtype.kind == "f" else 2):
        return True
    finite = values[np.isfinite(values)]
    if not finite.size:
        return True
    low, high = float(finite.min()), float(finite.max())
    step = float(np.finfo(np.float32).eps) * max(abs(low), abs(high))
    # Of whole numbers that single precision has exactly none is lost.
    is_exact = values.dtype.kind in "iu" and max(abs(low), abs(high)) <= _MOST_EXACT
    return low == high or is_exact or high - low >= 256.0 * step


def columns_of(columns: Any) -> dict[str, Any]:
    """Columns by name, of a mapping or of a table that has them."""
    if columns is None:
        return {}
    # A data frame of pandas is no mapping, and gives its columns as one does.
    if not isinstance(columns, Mapping) and not (hasattr(columns, "items") and hasattr(columns, "columns")):
        found = f"{kind_of(columns)}; `values` takes one column without a name" if hasattr(columns, "__len__") else kind_of(columns)
        raise InputError(f"columns: expected arrays by name, such as {{\"temperature\": array}}, found {found}")
    named: dict[str, Any] = {}
    for name, values in columns.items():
        if str(name) in named:
            raise InputError(f"columns: expected each name once, found '{name}' twice")
        named[str(name)] = array_of(values, f"columns, '{name}'")
    return named


def halved_quads(rows: np.ndarray) -> np.ndarray:
    """Two triangles of what each corner of a four-sided face has: first one of each face, then the other."""
    return np.concatenate([rows[:, [0, 1, 2]], rows[:, [0, 2, 3]]])


def texture_of(thing: Any) -> Any:
    """An image as the extension takes it: a path, or an array."""
    if thing is None or isinstance(thing, (str, os.PathLike)):
        return thing
    # A texture of PyVista.
    pixels = array_of(thing.to_array() if hasattr(thing, "to_array") else thing, "texture")
    if np.ndim(pixels) == 2:
        raise InputError("texture: expected three channels or four, found one number a pixel; an image of Pillow has them after `convert('RGBA')`")
    return colors_of(pixels, "texture")


def plain(value: Any, name: str = "") -> Any:
    """A value as JSON has it; ``name`` is that of the key in messages."""
    place = f"{name}: " if name else ""
    if isinstance(value, Mapping):
        return {str(key): plain(part, str(key)) for key, part in value.items()}
    if isinstance(value, np.ndarray):
        return plain(value.tolist(), name)
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        raise InputError(f"{place}expected finite numbers, found {value}")
    if isinstance(value, Transfer):
        raise InputError(f"{place}expected a key of docs/scene.md, found what organza.transfer makes, which the argument `transfer` takes")
    if isinstance(value, (list, tuple)):
        return [plain(part, name) for part in value]
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if value is None or isinstance(value, (str, int, float)):
        return value
    kind = f"{type(value).__module__}.{type(value).__qualname__}"
    raise InputError(f"{place}expected numbers, texts, lists or tables, found {kind}")


def color_of(value: Any, name: str = "color") -> Any:
    """A colour as scenes have it, three linear numbers: of ``"#rrggbb"`` or of these; anything else is for the scene to refuse."""
    expected = f'{name}: expected "#rrggbb" or three linear numbers from 0 to 1'
    if isinstance(value, str):
        if not HEX_COLOR.fullmatch(value):
            raise InputError(f"{expected}, found {value!r}")
        # Decoded as the bytes of arrays are.
        rows = np.array([list(bytes.fromhex(value[1:]))], dtype=np.uint8)
        return plain(Data.points(np.zeros((1, 3)), colors=rows).arrays()["colors"][0])
    parts = parts_of(value)
    are_whole = all(isinstance(part, (int, np.integer)) for part in parts)
    if len(parts) == 3 and are_whole and all(0 <= part <= _MOST_OF_A_BYTE for part in parts) and max(parts) > 1:
        bytes_of = "".join(f"{int(part):02x}" for part in parts)
        raise InputError(f'{expected}, found the bytes {value!r}; "#{bytes_of}" is the same colour')
    return value


def finite_steps(steps: np.ndarray, found: Any) -> None:
    """Refuses steps of a volume that are not finite, and those of no length."""
    if not (np.isfinite(steps).all() and steps.all()):
        raise InputError(f"spacing: expected finite steps above 0, found {found!r}")


def radii_of(radius: Any, count: int) -> np.ndarray:
    """The radii of points, one a point."""
    expected = f"radius: expected numbers above 0 in the unit of the positions, one or {count}"
    if isinstance(radius, str):
        raise InputError(f"{expected}, found {radius!r}")
    array = np.asarray(array_of(radius, "radius"), dtype=float)
    if array.shape not in ((), (count,)):
        raise InputError(f"{expected}, found the shape {array.shape}")
    wrong = ~(np.isfinite(array) & (array > 0.0))
    if wrong.any():
        row = int(np.argmax(wrong))
        raise InputError(f"{expected}, found {array.flat[row]}" + (f" in row {row}" if array.ndim else ""))
    return np.broadcast_to(array, (count,))
