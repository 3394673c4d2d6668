"""Volumes: their data, and where they lie."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from organza import adopted
from organza._organza import Data, InputError
from organza.arrays import array_of


@dataclass(frozen=True)
class Lattice:
    """Where a volume lies."""

    diagonal: float
    middle: list[float]
    corners: np.ndarray


def lattice_of(values: Any, spacing: Any = 1.0, origin: Any = (0.0, 0.0, 0.0), direction: Any = None) -> tuple[Data, Lattice]:
    """The data of a volume, and where it lies."""
    grid = array_of(values)
    steps = np.asarray(spacing, dtype=float)
    if steps.shape not in ((), (3,)):
        raise InputError(f"spacing: expected one number or three, found the shape {steps.shape}")
    steps = np.broadcast_to(steps, (3,))
    turn = np.eye(3) if direction is None else np.asarray(direction, dtype=float).reshape(3, 3)
    first = np.asarray(origin, dtype=float)
    data = Data.grid(grid, steps.tolist(), first.tolist(), turn.tolist())
    sides = steps * (np.array(grid.shape[::-1]) - 1)
    ends = np.stack(np.meshgrid([0.0, 1.0], [0.0, 1.0], [0.0, 1.0]), -1).reshape(-1, 3)
    corners = first + (ends * sides) @ turn.T
    return data, Lattice(float(np.linalg.norm(sides)), (first + turn @ sides / 2.0).tolist(), corners)


def volume_arguments(values: Any, spacing: Any, origin: Any, direction: Any) -> tuple[dict[str, Any], dict[str, Any]]:
    """Arguments of :func:`lattice_of`, of an array or a data set; and the transform that the data set's library has."""
    arguments = adopted.volume_of(values)
    stated = {"spacing": spacing, "origin": origin, "direction": direction}
    arguments |= {key: value for key, value in stated.items() if value is not None}
    transform = arguments.pop("transform", None)
    return arguments, {} if transform is None else {"transform": transform}


def percentiles(values: Any) -> tuple[float, float]:
    """The 1st and 99th percentile of the finite values, growing in any case."""
    numbers = np.asarray(array_of(values), dtype=float)
    finite = numbers[np.isfinite(numbers)]
    if not finite.size:
        raise InputError("values: expected a voxel with a value, found none")
    low, high = (float(end) for end in np.percentile(finite, [1.0, 99.0]))
    return (low, high) if low < high else (low, low + max(abs(low), 1.0))
