"""Transfer functions: what the values of a volume show."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from organza._organza import InputError, map_colors
from organza.checking import named

# Colours between the first value and the last: a map is a curve.
_COLORS = 33
# A scene takes opacities below 1.
_MOST_OPAQUE = 0.9999
# Parts of a volume's diagonal over which opacities count, where nothing else is said.
_PARTS = 20.0


@dataclass(frozen=True)
class Transfer:
    """Colours and opacities by value; made by :func:`transfer`."""

    points: tuple[dict[str, Any], ...]
    unit_length: float | None

    def keys(self, diagonal: float) -> dict[str, Any]:
        """The keys of an object in a scene that has such a diagonal, in the unit of its data."""
        unit_length = diagonal / _PARTS if self.unit_length is None else self.unit_length
        return {"transfer": [dict(point) for point in self.points], "unit_length": unit_length}


@named
def transfer(
    colormap: str = "viridis",
    clim: tuple[float, float] = (0.0, 1.0),
    opacity: Sequence[float] = (0.0, 1.0),
    unit_length: float | None = None,
) -> Transfer:
    """A transfer function: the colours of a map, and an opacity that goes through some numbers.

    Parameters
    ----------
    colormap
        ``viridis``, ``magma``, ``inferno``, ``plasma``, ``cividis``, ``turbo``, ``grey`` and the other maps of ``docs/scene.md``.
    clim
        The values of the first and the last colour. Values beyond have the colour and the opacity of the nearest end.
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
    if not isinstance(clim, (tuple, list, np.ndarray)) or len(clim) != 2:
        raise InputError(f"clim: expected two growing numbers, found {clim!r}")
    low, high = (float(value) for value in clim)
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        raise InputError(f"clim: expected two growing numbers, found {clim!r}")
    if not isinstance(opacity, (tuple, list, np.ndarray)):
        raise InputError(f"opacity: expected two or more numbers from 0 to 1, found {opacity!r}")
    knots = [float(value) for value in opacity]
    if len(knots) < 2 or not all(0.0 <= knot <= 1.0 for knot in knots):
        raise InputError(f"opacity: expected two or more numbers from 0 to 1, found {list(opacity)!r}")
    last = len(knots) - 1
    places = {step / (_COLORS - 1) for step in range(_COLORS)} | {step / last for step in range(len(knots))}
    ordered = sorted(places)
    points = []
    for place, color in zip(ordered, map_colors(colormap, ordered)):
        below = min(int(place * last), last - 1)
        part = place * last - below
        opaque = knots[below] + (knots[below + 1] - knots[below]) * part
        points.append({"value": low + (high - low) * place, "color": list(color), "opacity": min(opaque, _MOST_OPAQUE)})
    return Transfer(tuple(points), None if unit_length is None else float(unit_length))
