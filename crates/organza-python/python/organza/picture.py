"""A picture that was drawn."""

from __future__ import annotations

import json
import os
import warnings
from os import PathLike
from typing import Any

import numpy as np

from organza import _organza
from organza._organza import InputError
from organza.values import flag


class Picture:
    """A picture: layers as arrays, and what is known of how it was drawn.

    ``picture.rgb`` is what is seen, ``picture["depth.median"]`` another layer, if the scene's ``render.layers`` asks for it. A notebook shows it.

    A picture can be pickled, with its layers and its legends.
    """

    def __init__(self, drawn: _organza.Picture, remarks: list[str]):
        self._drawn = drawn
        self._facts: dict[str, Any] = json.loads(drawn.facts)
        self._remarks = remarks

    @property
    def size(self) -> tuple[int, int]:
        """Width and height, pixels."""
        return self._drawn.size

    @property
    def layers(self) -> list[str]:
        """Names of its layers; ``beauty`` and ``alpha`` are always there."""
        return self._drawn.layers

    @property
    def rgb(self) -> np.ndarray:
        """What is seen, (height, width, 3), linear Rec.709 radiance."""
        return self["beauty"]

    @property
    def alpha(self) -> np.ndarray:
        """Opacity of what lies before the background, (height, width), 0 to 1."""
        return self["alpha"]

    def __getitem__(self, name: str) -> np.ndarray:
        """A layer by its name, or one of its channels, such as ``direct.R``: an array of its own.

        Raises
        ------
        KeyError
            For a layer that the picture has not.
        """
        if not isinstance(name, str):
            raise KeyError(f"expected the name of a layer, such as {self.layers[0]!r}, found {name!r}")
        layer, _, channel = name.rpartition(".")
        if layer in self.layers and channel in ("R", "G", "B"):
            return np.ascontiguousarray(self._drawn.layer(layer)[..., "RGB".index(channel)])
        if name not in self.layers:
            raise KeyError(f"'{name}': the picture has {', '.join(self.layers)}; render.layers of a scene asks for others")
        return self._drawn.layer(name)

    @property
    def camera(self) -> dict[str, Any]:
        """Where it was seen from, and whether that place was found."""
        camera: dict[str, Any] = self._facts["camera"]
        return camera

    @property
    def plan(self) -> dict[str, Any]:
        """Effects and passes with their reasons, as ``organza explain --json`` has them."""
        plan: dict[str, Any] = self._facts["plan"]
        return plan

    @property
    def cost(self) -> list[dict[str, Any]]:
        """What each pass took, as ``organza render --cost`` writes it."""
        cost: list[dict[str, Any]] = self._facts["cost"]
        return cost

    @property
    def goal(self) -> dict[str, Any] | None:
        """How the picture keeps to a time or an error; None where none was asked for.

        ``budget_ms``, ``max_rmse``, ``max_flip`` as they were asked for, ``expected_seconds``, ``taken_seconds``, ``expected_rmse``, ``expected_flip``,
        ``errors_of`` (``"this scene"``, or ``"typical scenes"`` where small pictures of this one would take too much of the time), ``given_up`` (a list of ``key``, ``asked`` and ``taken``), and ``ladder``: the settings that were weighed, with ``antialias``, ``splat_share``,
        ``sets``, ``seconds``, ``rmse`` and ``flip``.
        """
        goal: dict[str, Any] | None = self._facts.get("goal")
        return goal

    @property
    def warnings(self) -> list[str]:
        """What a user should know of the picture, one sentence each."""
        warnings: list[str] = self._facts["warnings"]
        return warnings

    @property
    def notes(self) -> list[str]:
        """What the data holds that is not shown, what was made of it, and what a first scene decided, one sentence each."""
        notes: list[str] = self._facts["notes"]
        return self._remarks + notes

    def to_srgb8(self, transparent: bool = False) -> np.ndarray:
        """The displayed picture, bytes of sRGB as its PNG file has them: (height, width, 3), or 4 channels where ``transparent``."""
        return self._drawn.srgb8(flag("transparent", transparent))

    def save(
        self,
        path: str | PathLike[str],
        *,
        transparent: bool = False,
        deep: bool = False,
        half: bool = False,
        legend: bool | str = False,
        force: bool = True,
    ) -> None:
        """Writes an OpenEXR file with all layers, or a PNG, WebP or JPEG file of what is displayed, by the ending of the name.

        Parameters
        ----------
        path
            Where, ending in ``.exr``, ``.png``, ``.webp``, ``.jpg`` or ``.jpeg``; the file appears whole or not at all. A WebP file has the pixels of a PNG file
            of 8 bits, and a JPEG file is near them.
        transparent
            Opacity in the place of the background, which a JPEG file has not; the picture is to be drawn with ``transparent=True``.
        deep
            16 bits a channel in a PNG file.
        half
            16 bits a channel in an OpenEXR file.
        legend
            What colours stand for in a PNG, WebP or JPEG file: ``True`` or ``"over"`` over the right border of the picture, ``"beside"`` in a strip to the right
            of it, which makes the file wider and covers nothing.
        force
            Whether a file of that name is replaced.
        """
        if not isinstance(legend, (bool, str)):
            raise InputError(f"legend: expected True, False, 'over' or 'beside', found {legend!r}")
        transparent, deep, half, force = (
            flag(name, value) for name, value in (("transparent", transparent), ("deep", deep), ("half", half), ("force", force))
        )
        ending = os.path.splitext(os.fspath(path))[1].lower()
        is_exr = ending == ".exr"
        # Of an ending that no file has, writing says so.
        has_bytes = ending in (".jpg", ".jpeg", ".webp")
        without_effect = [("deep", deep and (is_exr or has_bytes)), ("legend", bool(legend) and is_exr), ("half", half and not is_exr)]
        for name, is_asked in without_effect:
            if is_asked:
                raise InputError(f"{name}: expected a file that can have it, found {os.fspath(path)}")
        if not force and os.path.exists(path):
            raise FileExistsError(f"{os.fspath(path)}: this file exists already; force=True replaces it")
        place = legend if isinstance(legend, str) else "over" if legend else None
        for sentence in self._drawn.save(path, transparent, deep, half, place, force):
            warnings.warn(sentence, stacklevel=2)

    def __getstate__(self) -> dict[str, Any]:
        drawn = self._drawn
        layers = {name: drawn.layer(name) for name in self.layers}
        return {"layers": layers, "facts": drawn.facts, "metadata": drawn.metadata, "legends": drawn.legends, "remarks": self._remarks}

    def __setstate__(self, state: dict[str, Any]) -> None:
        drawn = _organza.Picture.of_parts(state["layers"], state["facts"], state["metadata"], state["legends"])
        self.__init__(drawn, state["remarks"])  # type: ignore[misc]

    def _repr_png_(self) -> bytes:
        return self._drawn.png()

    def __repr__(self) -> str:
        width, height = self.size
        return f"<organza.Picture {width}x{height}: {', '.join(self.layers)}>"
