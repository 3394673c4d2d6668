"""Transfer functions: what the values of a volume show."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from organza._organza import InputError, map_colors
from organza.checking import named
from organza.values import HEX_COLOR, kind_of, number, parts_of

# Colours between the first value and the last: a map is a curve.
_COLORS = 33
# The same of a map of matplotlib, which may have steps.
_COLORS_OF_OTHERS = 256
# Maps whose middle is 0 where numbers have both signs.
_DIVERGING = ("coolwarm",)
# A scene takes opacities below 1.
_MOST_OPAQUE = 0.9999
# Parts of a volume's diagonal over which opacities count, where nothing else is said.
_PARTS = 20.0
# Where a colour of sRGB begins to be a power, its slope below, and the power (IEC 61966-2-1).
_LINEAR_BELOW = 0.04045
_SLOPE = 12.92
_OFFSET = 0.055
_POWER = 2.4

# The values at the ends of a map; None for an end that the data has.
Ends = tuple[float | None, float | None]
# Colours of a display, (n, 3) from 0 to 1, at places from 0 to 1.
_Colors = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Transfer:
    """Colours and opacities by value; made by :func:`transfer`."""

    knots: tuple[dict[str, Any], ...]
    """Colours and opacities by their place between the ends, 0 to 1."""
    clim: Ends
    unit_length: float | None
    is_diverging: bool
    """Whether the middle of the map is that of numbers with both signs."""

    @property
    def points(self) -> list[dict[str, Any]]:
        """Colours and opacities by value, from 0 to 1 where the data has to tell the ends."""
        low, high = self.clim
        return self.points_over((0.0, 1.0) if low is None or high is None else (low, high))

    def ends(self, found: Callable[[], tuple[float, float]]) -> tuple[float, float]:
        """The values at the ends of the map, of which those that are not stated are found in the data; those of a map that diverges lie as far from 0."""
        low, high = self.clim
        if low is not None and high is not None:
            return low, high
        least, greatest = found()
        if self.is_diverging and low is None and high is None and least < 0.0 < greatest:
            farther = max(-least, greatest)
            return -farther, farther
        ends = (least if low is None else low, greatest if high is None else high)
        if not ends[0] < ends[1]:
            raise InputError(f"clim: expected two growing numbers, found {self.clim}, and {least:g} to {greatest:g} in the data")
        return ends

    def points_over(self, ends: tuple[float, float]) -> list[dict[str, Any]]:
        """Colours and opacities by value between two ends."""
        low, high = ends
        return [{"value": low + (high - low) * knot["place"], "color": list(knot["color"]), "opacity": knot["opacity"]} for knot in self.knots]

    def colors_over(self, ends: tuple[float, float]) -> list[dict[str, Any]]:
        """The colours alone."""
        return [{key: point[key] for key in ("value", "color")} for point in self.points_over(ends)]

    def keys(self, diagonal: float, ends: tuple[float, float]) -> dict[str, Any]:
        """The keys of an object in a scene that has such a diagonal, in the unit of its data, and such values at the ends of the map."""
        unit_length = diagonal / _PARTS if self.unit_length is None else self.unit_length
        return {"transfer": self.points_over(ends), "unit_length": unit_length}


@named
def transfer(
    colormap: Any = "viridis",
    clim: tuple[float | None, float | None] | None = None,
    opacity: Sequence[float] = (0.0, 1.0),
    unit_length: float | None = None,
) -> Transfer:
    """A transfer function: the colours of a map, and an opacity that goes through some numbers.

    Parameters
    ----------
    colormap
        ``viridis``, ``magma``, ``inferno``, ``plasma``, ``cividis``, ``turbo``, ``grey`` and the other maps of ``docs/scene.md``; a colormap of matplotlib; or
        a list of colours ``"#rrggbb"``.
    clim
        The values of the first and the last colour. Values beyond have the colour and the opacity of the nearest end. In the place of None, of both or of
        one of them, stands the 1st and the 99th percentile of the data that shows it; of ``coolwarm`` and values with both signs, as far from 0 as the farther
        of these.
    opacity
        Numbers from 0 to 1, evenly spaced over ``clim``: the opacity of ``unit_length`` of such values.
    unit_length
        The length that opacities refer to, in the unit of the data; a twentieth of the volume's diagonal where it is None.

    Returns
    -------
    Transfer
        For ``Scene.add_volume(…, transfer=…)``.

    Raises
    ------
    InputError
        For a map that there is not, a ``clim`` that does not grow, and opacities beyond 0 and 1.
    """
    ends = clim_of(clim)
    expected = "opacity: expected two or more numbers from 0 to 1"
    if not isinstance(opacity, (tuple, list, np.ndarray)):
        raise InputError(f"{expected}, found {opacity!r}")
    opacities = [number("opacity", value) for value in parts_of(opacity)]
    if len(opacities) < 2 or not all(0.0 <= value <= 1.0 for value in opacities):
        raise InputError(f"{expected}, found {opacity!r}")
    last = len(opacities) - 1
    colors, count = _map_of(colormap)
    places = {step / (count - 1) for step in range(count)} | {step / last for step in range(len(opacities))}
    ordered = sorted(places)
    knots = []
    for place, color in zip(ordered, colors(np.array(ordered)).tolist()):
        below = min(int(place * last), last - 1)
        part = place * last - below
        opaque = opacities[below] + (opacities[below + 1] - opacities[below]) * part
        knots.append({"place": place, "color": color, "opacity": min(opaque, _MOST_OPAQUE)})
    length = None if unit_length is None else number("unit_length", unit_length)
    if length is not None and length <= 0.0:
        raise InputError(f"unit_length: expected a length above 0, found {unit_length!r}")
    return Transfer(tuple(knots), ends, length, isinstance(colormap, str) and colormap in _DIVERGING)


def clim_of(clim: Any) -> Ends:
    """The ends of a map from an argument."""
    if clim is None:
        return None, None
    expected = "clim: expected two growing numbers, or None for an end that the data has"
    parts = parts_of(clim)
    if len(parts) != 2 or any(isinstance(part, (bool, np.bool_, str)) for part in parts):
        raise InputError(f"{expected}, found {clim!r}")
    stated = [part for part in parts if part is not None]
    if any(isinstance(part, (float, np.floating)) and not math.isfinite(part) for part in stated):
        raise InputError(f"clim: expected finite numbers, found {', '.join(str(part) for part in stated if not math.isfinite(part))}")
    low, high = (None if part is None else number("clim", part) for part in parts)
    if low is not None and high is not None and not low < high:
        raise InputError(f"{expected}, found {clim!r}")
    return low, high


def is_named(colormap: Any) -> bool:
    """Whether a map is one that scenes know by its name; refuses what is no map."""
    if colormap is None or isinstance(colormap, str):
        return True
    _map_of(colormap)
    return False


def _map_of(colormap: Any) -> tuple[_Colors, int]:
    """The linear colours of a map, and how many show it as it is."""
    expected = 'colormap: expected the name of a map, a colormap of matplotlib, or two or more colours "#rrggbb"'
    if isinstance(colormap, str):
        return (lambda places: np.array(map_colors(colormap, places.tolist()))), _COLORS
    if callable(colormap) and not isinstance(colormap, type):
        return _called(colormap, expected), _COLORS_OF_OTHERS
    if isinstance(colormap, np.ndarray) and colormap.dtype == np.uint8 and colormap.ndim == 2 and colormap.shape[1] in (3, 4) and len(colormap) > 1:
        return _between(colormap[:, :3] / 255.0), max(_COLORS, len(colormap))
    parts = parts_of(colormap)
    if len(parts) > 1 and all(isinstance(part, str) and HEX_COLOR.fullmatch(part) for part in parts):
        return _between(np.array([list(bytes.fromhex(part[1:])) for part in parts]) / 255.0), max(_COLORS, len(parts))
    found = kind_of(colormap)
    if isinstance(colormap, np.ndarray) and colormap.dtype.kind == "f":
        found = f"{found}; colours of a display are bytes: `(255 * array).astype(np.uint8)`"
    raise InputError(f"{expected}, found {found}")


def _called(colormap: Callable[[np.ndarray], Any], expected: str) -> _Colors:
    """The colours of a function of places, as a colormap of matplotlib is one."""

    def colors(places: np.ndarray) -> np.ndarray:
        try:
            found = np.asarray(colormap(places), dtype=float)
        except (TypeError, ValueError) as error:
            raise InputError(f"{expected}, found a function that raises {type(error).__name__}: {error}") from None
        if found.ndim != 2 or len(found) != len(places) or found.shape[1] not in (3, 4) or not np.isfinite(found).all():
            raise InputError(f"{expected}, found a function whose colours have the shape {found.shape}")
        return _linear(np.clip(found[:, :3], 0.0, 1.0))

    colors(np.linspace(0.0, 1.0, 2))
    return colors


def _between(table: np.ndarray) -> _Colors:
    """Colours of a display, evenly spaced, and those between them."""
    steps = np.linspace(0.0, 1.0, len(table))
    return lambda places: _linear(np.stack([np.interp(places, steps, table[:, channel]) for channel in range(3)], axis=-1))


def _linear(colors: np.ndarray) -> np.ndarray:
    """Linear colours of those of a display, from 0 to 1."""
    return np.where(colors <= _LINEAR_BELOW, colors / _SLOPE, ((colors + _OFFSET) / (1.0 + _OFFSET)) ** _POWER)
