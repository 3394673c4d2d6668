"""Draws meshes, volumes, point clouds and implicit surfaces together, translucent, lit and shadowed.

>>> import organza as og
>>> picture = og.render("head.nii.gz", preset="ct-bone")      # what `organza render FILE` draws   # doctest: +SKIP
>>> picture.save("head.png")                                                                       # doctest: +SKIP

Lengths are in the units of the data; x points right, y up, z towards the viewer. Arrays of volumes have the axes z, y, x, as numpy has them in C
order: ``values[k, j, i]`` lies at ``origin + i * step_x + j * step_y + k * step_z``. Colours are linear Rec.709, or sRGB where an array is of bytes.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from organza._organza import InputError, LimitError
from organza.describing import accuracy, explain, info, orders
from organza.drawing import render, turntable
from organza.picture import Picture
from organza.scene import Scene
from organza.transfers import transfer
from organza.viewing import View, view

if TYPE_CHECKING:
    from organza import dask


def __getattr__(name: str) -> Any:
    """Imports ``organza.dask`` when it is used: it needs the package dask, which nothing else does."""
    if name == "dask":
        return importlib.import_module("organza.dask")
    raise AttributeError(f"module 'organza' has no attribute '{name}'")


__all__ = [
    "InputError",
    "LimitError",
    "Picture",
    "Scene",
    "View",
    "accuracy",
    "dask",
    "explain",
    "info",
    "orders",
    "render",
    "transfer",
    "turntable",
    "view",
]
