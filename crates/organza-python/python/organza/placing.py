"""Cameras and lights of a scene: called with keys, or placed by angles."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from organza import _organza
from organza._organza import InputError
from organza.arrays import plain
from organza.checking import check_sun_keys, named
from organza.values import kind_of, number, parts_of, place_of, sides_of

if TYPE_CHECKING:
    from organza.scene import Scene


# Places of an object that are looked for in the view of a camera.
_SAMPLES = 4096


class Camera:
    """The camera of a scene, ``scene.camera``: called with its keys, or taken around what the scene shows."""

    def __init__(self, scene: Scene):
        self._scene = scene

    @named
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
        camera = dict(self._scene._document.get("camera", {}))
        angles = {"azimuth": azimuth, "elevation": elevation, "fit": fit, "fov_y": fov_y}
        stated: dict[str, Any] = {"position": position, "target": target, "size": sides_of(size)}
        stated |= {key: None if value is None else number(key, value) for key, value in angles.items()}
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
        camera.update({key: plain(value, key) for key, value in stated.items() if value is not None})
        _check_camera(camera)
        self._scene._document["camera"] = camera

    @named
    def orbit(self, azimuth: float = 30.0, elevation: float = 20.0, fit: float = 0.9) -> None:
        """Takes the camera around the middle of what the scene shows, at the distance from which all of it is seen.

        The place is found when the picture is drawn, so that data which is added later is seen too. The ground of :meth:`Scene.ground` does not count.

        Parameters
        ----------
        azimuth
            Degrees about +Y, from +Z towards +X.
        elevation
            Degrees above the horizon, -90 to 90.
        fit
            Share of the picture's width or height that is filled, above 0 and at most 1: with 1 the data touches the borders of the picture.
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
        if not isinstance(kind, str):
            raise InputError(f"kind: expected a text, such as 'directional' or 'point', found {kind_of(kind)}")
        called = {} if name is None else {"name": name}
        light = plain({"kind": kind} | called | {key: value for key, value in keys.items() if value is not None})
        _organza.check(json.dumps({"version": 1, "camera": {"auto": True}, "light": [light]}), {})
        self._scene._document.setdefault("light", []).append(light)

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
        check_sun_keys(Light.sun, name, keys)
        turn = math.radians(number("azimuth", azimuth))
        rise = math.radians(number("elevation", elevation))
        if not -90.0 <= elevation <= 90.0:
            raise InputError(f"elevation: expected degrees from -90 to 90, found {elevation!r}")
        level = math.cos(rise)
        # Light travels away from where it comes from.
        direction = [-math.sin(turn) * level, -math.sin(rise), -math.cos(turn) * level]
        radiance = None if sky is None else _color("sky", sky)
        self(direction=direction, irradiance=_color("irradiance", irradiance), name=name, **keys)
        if elevation < 0.0:
            self._scene._remarks.append(f"{name}: it stands {-elevation:g}° below the horizon, and lights from below")
        if radiance is not None:
            self._scene._document.setdefault("ambient", {}).setdefault("color", radiance)


def _check_camera(camera: Mapping[str, Any]) -> None:
    """Refuses keys of a camera that are beyond what they may be. A position and its target may be stated one after the other."""
    places = [place_of(key, camera[key]) for key in ("position", "target") if key in camera]
    if len(places) == 2 and places[0] == places[1]:
        raise InputError(f"target: expected another place than the position, found {places[1]} for both")
    is_placed = len(places) == 2
    probe = {key: value for key, value in camera.items() if is_placed or key not in ("position", "target", "up")}
    probe = {"size": [16, 9]} | probe | ({} if is_placed else {"auto": True})
    _organza.check(json.dumps({"version": 1, "camera": probe}), {})


def beyond(camera: Mapping[str, Any], places: Any, transform: Mapping[str, Any]) -> float:
    """The share of places that a camera with a position does not see, of some thousand of them."""
    every = np.asarray(places)
    if every.ndim != 2 or not len(every):
        return 0.0
    # A large array is not copied.
    rows = _transformed(every[:: max(len(every) // _SAMPLES, 1)].astype(float), transform)
    eye = np.asarray(camera["position"], dtype=float)
    forward = _unit(np.subtract(camera.get("target", (0.0, 0.0, 0.0)), eye))
    right = _unit(np.cross(forward, camera.get("up", (0.0, 1.0, 0.0))))
    above = np.cross(right, forward)
    seen = rows - eye
    depth = seen @ forward
    width, height = camera.get("size", (16, 9))
    half = math.tan(math.radians(camera.get("fov_y", 45.0)) / 2.0)
    is_seen = (depth > 0.0) & (np.abs(seen @ above) <= half * depth) & (np.abs(seen @ right) <= half * depth * width / height)
    return 1.0 - float(is_seen.mean())


def _unit(vector: np.ndarray) -> np.ndarray:
    unit: np.ndarray = vector / (float(np.linalg.norm(vector)) or 1.0)
    return unit


def _transformed(places: np.ndarray, transform: Mapping[str, Any]) -> np.ndarray:
    """Places after the ``transform`` of an object: turned upright, scaled, rotated about x, y and z, and moved."""
    upright = {"z": np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]), "-y": np.diag([1.0, -1.0, -1.0])}
    turn = upright.get(transform.get("up", "y"), np.eye(3))
    for axis, degrees in enumerate(transform.get("rotate", (0.0, 0.0, 0.0))):
        sine, cosine = math.sin(math.radians(degrees)), math.cos(math.radians(degrees))
        first, second = (axis + 1) % 3, (axis + 2) % 3
        about = np.eye(3)
        about[first, first] = about[second, second] = cosine
        about[first, second], about[second, first] = -sine, sine
        turn = about @ turn
    moved = np.asarray(transform.get("translate", (0.0, 0.0, 0.0)), dtype=float)
    turned: np.ndarray = float(transform.get("scale", 1.0)) * places @ turn.T + moved
    return turned


def _color(name: str, value: Any) -> list[float]:
    """Three channels, of one number or three."""
    parts = parts_of(value) if isinstance(value, (list, tuple, np.ndarray)) else [value] * 3
    if len(parts) != 3:
        raise InputError(f"{name}: expected one number or three, found {value!r}")
    return [number(name, part) for part in parts]
