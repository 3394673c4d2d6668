"""Volumes: their data, and where they lie."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from organza import adopted
from organza._organza import Data, InputError
from organza.arrays import is_told_apart, array_of, finite_steps
from organza.values import place_of


@dataclass(frozen=True)
class Lattice:
    """Where a volume lies."""

    diagonal: float
    middle: list[float]
    corners: np.ndarray


def lattice_of(
    values: Any, spacing: Any = 1.0, origin: Any = (0.0, 0.0, 0.0), direction: Any = None, name: str = "values"
) -> tuple[Data, Lattice]:
    """The data of a volume, which is the argument ``name``, and where it lies."""
    grid = array_of(values, name)
    steps = _steps(spacing)
    finite_steps(steps, spacing)
    if np.ndim(grid) != 3:
        part = "; take one volume of a series, or one channel, such as `values[0]`" if np.ndim(grid) == 4 else ""
        raise InputError(f"{name}: expected the shape (nz, ny, nx), found {np.shape(grid)}{part}")
    if not grid.size:
        raise InputError(f"{name}: expected a volume with voxels, found the shape {grid.shape}")
    if grid.dtype.kind == "f" and np.isinf(grid).any():
        place = np.argwhere(np.isinf(grid))[0].tolist()
        raise InputError(f"{name}: expected voxels of finite numbers, or NaN for a gap, found {grid[tuple(place)]} at {place}")
    if not is_told_apart(grid):
        low = float(np.nanmin(grid))
        raise InputError(f"{name}: expected values that single precision tells apart, found some that differ by little beside {low:g}; `{name} - {low:g}` does")
    steps = np.broadcast_to(steps, (3,))
    turn = np.eye(3) if direction is None else _directions(direction)
    first = np.array(place_of("origin", origin))
    data = Data.grid(grid, steps.tolist(), first.tolist(), turn.tolist())
    sides = steps * (np.array(grid.shape[::-1]) - 1)
    ends = np.stack(np.meshgrid([0.0, 1.0], [0.0, 1.0], [0.0, 1.0]), -1).reshape(-1, 3)
    corners = first + (ends * sides) @ turn.T
    return data, Lattice(float(np.linalg.norm(sides)), (first + turn @ sides / 2.0).tolist(), corners)


def _steps(spacing: Any) -> np.ndarray:
    """The steps of a volume, one number or three."""
    if isinstance(spacing, str):
        raise InputError(f"spacing: expected one number or three, found {spacing!r}")
    steps = np.asarray(array_of(spacing, "spacing"), dtype=float)
    if steps.shape not in ((), (3,)):
        raise InputError(f"spacing: expected one number or three, found the shape {steps.shape}")
    return steps


def _directions(direction: Any) -> np.ndarray:
    """Directions of the steps, the columns of a matrix that spans space."""
    try:
        turn = np.asarray(direction, dtype=float).reshape(3, 3)
    except (TypeError, ValueError):
        raise InputError(f"direction: expected a matrix (3, 3), found {direction!r}") from None
    if not np.isfinite(turn).all() or np.linalg.matrix_rank(turn) < 3:
        raise InputError(f"direction: expected three columns that span space, found {turn.tolist()!r}")
    return turn


def check_level(level: float, values: Any) -> None:
    """Refuses a level that no surface of the values has."""
    low, high = _ends(values)
    if not low <= level <= high:
        raise InputError(f"level: expected a value of the volume, which are {low:g} to {high:g}, found {level:g}")


def check_plane(center: list[float], normal: list[float], corners: np.ndarray) -> None:
    """Refuses a plane that does not meet a volume."""
    heights = (corners - np.array(center)) @ np.array(normal)
    # A plane along a side of the volume meets it, whatever the rounding.
    room = 1e-9 * float(np.abs(heights).max())
    if (heights > room).all() or (heights < -room).all():
        low, high = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
        raise InputError(f"center: expected a plane through the volume, which lies from {low} to {high}, found {center}")


def _ends(values: Any) -> tuple[float, float]:
    """The least and the largest finite value."""
    numbers = np.asarray(array_of(values, "values"))
    if np.issubdtype(numbers.dtype, np.floating):
        numbers = numbers[np.isfinite(numbers)]
    if not numbers.size:
        raise InputError("values: expected a voxel with a value, found none")
    return float(numbers.min()), float(numbers.max())


def volume_arguments(values: Any, spacing: Any, origin: Any, direction: Any, name: str = "values") -> tuple[dict[str, Any], dict[str, Any]]:
    """Arguments of :func:`lattice_of`, of an array or a data set, which is the argument ``name``; and the transform that the data set's library has."""
    if values is None:
        raise InputError(f"{name}: expected a volume, found None")
    arguments = adopted.volume_of(values, name)
    stated = {"spacing": spacing, "origin": origin, "direction": direction}
    arguments |= {key: value for key, value in stated.items() if value is not None}
    # Steps of other libraries may go backwards; those of an argument are lengths.
    if spacing is not None and (_steps(spacing) < 0.0).any():
        raise InputError(f"spacing: expected steps above 0, found {spacing!r}; `direction` turns an axis, and `values[::-1]` its order")
    transform = arguments.pop("transform", None)
    return arguments, {} if transform is None else {"transform": transform}


def percentiles(values: Any, name: str = "values", what: str = "a voxel with a value") -> tuple[float, float]:
    """The 1st and 99th percentile of the finite values; where both are one, the least and greatest; growing in any case."""
    numbers = np.asarray(array_of(values, name))
    if numbers.dtype.kind == "f":
        numbers = numbers.astype(np.float64)
        numbers = numbers[np.isfinite(numbers)]
    if not numbers.size:
        raise InputError(f"{name}: expected {what}, found none")
    low, high = (float(end) for end in np.percentile(numbers, [1.0, 99.0]))
    if low == high:
        low, high = float(numbers.min()), float(numbers.max())
    return (low, high) if low < high else (low, low + max(abs(low), 1.0))
