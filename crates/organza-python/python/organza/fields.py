"""Second volumes, whose values surfaces show."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from organza._organza import Data, InputError
from organza.arrays import array_of
from organza.lattices import lattice_of, percentiles, volume_arguments
from organza.transfers import Transfer
from organza.transfers import transfer as make_transfer

# What a table may say of a field that is no file.
_LATTICE = ("values", "spacing", "origin", "direction", "interpolation")


@dataclass(frozen=True)
class Field:
    """A field that a surface shows: the keys of its object, and its data where that is in memory."""

    data: Data | None
    table: dict[str, Any]
    keys: dict[str, Any]


def field_of(
    field: Any,
    lattice: Mapping[str, Any],
    colormap: Any,
    clim: tuple[float | None, float | None] | None,
    transfer: Transfer | None,
    log_scale: bool = False,
    shape: tuple[int, ...] | None = None,
) -> Field:
    """A field from an argument; ``lattice`` is that of an array which states none, and ``shape`` the one that such an array then has."""
    if transfer is not None and not isinstance(transfer, Transfer):
        raise InputError(f"transfer: expected what organza.transfer makes, found {type(transfer).__name__}; `colormap` takes a name")
    if transfer is not None and (colormap is not None or clim is not None):
        raise InputError("transfer, colormap, clim: expected the colours of the field once, found them twice")
    if log_scale:
        raise InputError("log_scale: expected a column to colour by, found a `field`; give the logarithms of its values")
    colors = transfer if transfer is not None else make_transfer("viridis" if colormap is None else colormap, clim)
    table: dict[str, Any] = {}
    data = None
    values: Any = None
    if isinstance(field, (str, os.PathLike)):
        table["volume"] = os.path.abspath(field)
    elif isinstance(field, Mapping) and "values" not in field:
        table |= field
    else:
        stated = dict(field) if isinstance(field, Mapping) else {"values": field}
        unknown = [str(key) for key in stated if key not in _LATTICE]
        if unknown:
            raise InputError(f"field: expected the keys {', '.join(_LATTICE)}, found `{unknown[0]}`")
        if "interpolation" in stated:
            table["interpolation"] = stated["interpolation"]
        arguments, _ = volume_arguments(stated["values"], stated.get("spacing"), stated.get("origin"), stated.get("direction"), "field")
        values = arguments["values"]
        found = np.shape(array_of(values, "field"))
        if shape is not None and "spacing" not in arguments and len(found) == len(shape) and found != shape:
            raise InputError(
                f'field: expected the shape {shape} of `values`, found {found}; {{"values": …, "spacing": …}} states steps of its own'
            )
        data, _ = lattice_of(**(dict(lattice) | arguments), name="field, values")
    if values is None and None in colors.clim:
        ends = "none" if clim is None else clim
        raise InputError(f"clim: expected the values at the ends of the map for the field of a file, which is not read yet, found {ends}")
    return Field(data, table, {"transfer": colors.colors_over(colors.ends(lambda: percentiles(values, "field")))})
