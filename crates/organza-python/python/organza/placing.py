"""Cameras and lights of a scene: called with keys, or placed by angles."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from organza._organza import InputError
from organza.arrays import number, plain

if TYPE_CHECKING:
    from organza.scene import Scene


class Camera:
    """The camera of a scene, ``scene.camera``: called with its keys, or taken around what the scene shows."""

    def __init__(self, scene: Scene):
        self._scene = scene

    def __call__(
        self,
        *,
        position: Iterable[float] | None = None,
        target: Iterable[float] | None = None,
        azimuth: float | None = None,
        elevation: float | None = None,
        fit: float | None = None,
        fov_y: float | None = None,
        size: tuple[int, int] | None = None,
    ) -> None:
        """Places the camera: at a position, or so that everything is seen.

        Parameters
        ----------
        position, target
            Where the eye is, and a point in the middle of the picture.
        azimuth, elevation, fit
            As for :meth:`orbit`; not together with ``position``.
        fov_y
            Full vertical angle of view, degrees.
        size
            Width and height of the picture, pixels.

        Raises
        ------
        InputError
            For a position beside angles.
        """
        self._scene._check_open()
        camera = self._scene._document.setdefault("camera", {})
        stated = {
            "position": position,
            "target": target,
            "azimuth": azimuth,
            "elevation": elevation,
            "fit": fit,
            "fov_y": fov_y,
            "size": size,
        }
        if position is not None and not (azimuth is None and elevation is None and fit is None):
            raise InputError("camera: expected a position, or azimuth, elevation and fit, found both")
        # One way to place it takes the place of the other.
        if position is not None:
            for key in ("auto", "azimuth", "elevation", "fit"):
                camera.pop(key, None)
        elif not (azimuth is None and elevation is None and fit is None):
            for key in ("position", "target", "up"):
                camera.pop(key, None)
            camera["auto"] = True
        camera.update({key: plain(value) for key, value in stated.items() if value is not None})

    def orbit(self, azimuth: float = 30.0, elevation: float = 20.0, fit: float = 1.0) -> None:
        """Takes the camera around the middle of what the scene shows, at the distance from which all of it is seen.

        The place is found when the picture is drawn, so that data which is added later is seen too. The ground of :meth:`Scene.ground` does not count.

        Parameters
        ----------
        azimuth
            Degrees about +Y, from +Z towards +X.
        elevation
            Degrees above the horizon, -90 to 90.
        fit
            Share of the picture's width or height that is filled, above 0 and at most 1.
        """
        self(azimuth=azimuth, elevation=elevation, fit=fit)


class Light:
    """The lights of a scene, ``scene.light``: called with a kind and its keys, or a sun by its angles."""

    def __init__(self, scene: Scene):
        self._scene = scene

    def __call__(self, kind: str = "directional", *, name: str | None = None, **keys: Any) -> None:
        """Adds a light, such as ``scene.light(direction=(-1, -2, -1), irradiance=(3, 3, 3), name="sun")``.

        Parameters
        ----------
        kind
            ``"directional"``, ``"point"``, ``"spot"``, ``"sphere"``, ``"disk"`` or ``"rect"``.
        name
            By which effects call it, such as ``shadow.sun``.
        **keys
            Keys of a light (docs/scene.md).
        """
        self._scene._check_open()
        named = {} if name is None else {"name": name}
        self._scene._document.setdefault("light", []).append({"kind": kind} | named | plain(keys))

    def sun(
        self,
        azimuth: float = -15.0,
        elevation: float = 45.0,
        *,
        irradiance: Any = 3.0,
        sky: Any = 0.15,
        name: str = "sun",
        **keys: Any,
    ) -> None:
        """Adds parallel light from a direction, and light from all sides where the scene states none.

        Parameters
        ----------
        azimuth
            Where it comes from, degrees about +Y from +Z towards +X, as for :meth:`Camera.orbit`. A camera has it behind its left shoulder where this is
            45 less than the camera's.
        elevation
            Degrees above the horizon, -90 to 90.
        irradiance
            On a plane that faces the sun, W/m²: one number, or three for red, green and blue.
        sky
            Radiance from all sides, which lights shadows: one number or three, unless ``ambient.color`` is set already; None adds none.
        name
            By which effects call it, such as ``shadow.sun``.
        **keys
            Further keys of a directional light (docs/scene.md), such as ``shadow``.

        Raises
        ------
        InputError
            For what is no number, and for other counts than one and three.
        """
        turn = math.radians(number("azimuth", azimuth))
        rise = math.radians(number("elevation", elevation))
        if not -90.0 <= elevation <= 90.0:
            raise InputError(f"elevation: expected degrees from -90 to 90, found {elevation!r}")
        level = math.cos(rise)
        # Light travels away from where it comes from.
        direction = [-math.sin(turn) * level, -math.sin(rise), -math.cos(turn) * level]
        radiance = None if sky is None else _color("sky", sky)
        self(direction=direction, irradiance=_color("irradiance", irradiance), name=name, **keys)
        if radiance is not None:
            self._scene._document.setdefault("ambient", {}).setdefault("color", radiance)


def _color(name: str, value: Any) -> list[float]:
    """Three channels, of one number or three."""
    parts = list(value) if isinstance(value, (list, tuple, np.ndarray)) and np.ndim(value) == 1 else [value] * 3
    if len(parts) != 3:
        raise InputError(f"{name}: expected one number or three, found {value!r}")
    return [number(name, part) for part in parts]
