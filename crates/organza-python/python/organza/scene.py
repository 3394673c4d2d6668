"""Scenes: data, a camera, lights and materials, as a document that can be looked at and changed."""

from __future__ import annotations

import copy
import json
import math
import os
from collections.abc import Container, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from organza import _organza, adopted
from organza._organza import Data, InputError
from organza.transfers import Transfer

_DEFAULT_SIZE = (960, 540)
# The material of volumes that name none.
_LIT_VOLUME = "lit volume"
_LIT = {"shading": "phong", "specular": 0.08, "shininess": 24}
# A scene that is made here lies nowhere: files that it names are relative to the working folder.
_NOWHERE = "scene.json"
# A first scene lies in the working folder, as far as its paths go.
_FIRST = "scene.toml"
# Sources of a first scene, and how one names data in memory.
_SOURCES = ("mesh", "points", "volume")
_MEMORY = "memory:"


@dataclass(frozen=True)
class _Written:
    """A first scene as the command writes it, which is drawn as long as its document is not changed: a file then has the picture of the command."""

    document: dict[str, Any]
    text: str
    file: str


class Scene:
    """Objects, a camera, lights, and how they are drawn.

    What a scene does not state is found: a camera that sees all of it, lights that show it, and of a volume without a transfer function one that fits its
    values. Everything else is a key of ``docs/scene.md``, set by :meth:`set`.

    A scene can be pickled, with the data in it.

    >>> import numpy as np, organza as og
    >>> scene = og.Scene()
    >>> scene.add_points(np.random.default_rng(0).normal(size=(1000, 3)), name="cloud")
    >>> og.render(scene, size=(64, 48)).rgb.shape
    (48, 64, 3)
    """

    def __init__(self) -> None:
        self._document: dict[str, Any] = {"version": 1}
        self._text: str | None = None
        self._file = _NOWHERE
        self._data: dict[str, Data] = {}
        # What a first scene decided, and how it is written.
        self._remarks: list[str] = []
        self._written: _Written | None = None

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Scene:
        """A scene file as it is. It can be drawn and its effects switched; to change more of it, change the file."""
        scene = cls()
        scene._file = os.fspath(path)
        if Path(path).suffix.lower() not in (".toml", ".json"):
            raise InputError(f"{os.fspath(path)}: expected a scene, .toml or .json; Scene.from_files takes data files")
        scene._text = Path(path).read_text(encoding="utf-8")
        return scene

    @classmethod
    def from_files(cls, *paths: str | os.PathLike[str], **wishes: Any) -> Scene:
        """A first scene of data files, as ``organza init`` writes it; ``wishes`` are those of :func:`organza.render`: ``preset``, ``color_by``, ``up`` …"""
        return scene_of(paths, _no_wish() | wishes, _how())

    # Data.

    def add_points(
        self,
        positions: Any,
        *,
        colors: Any = None,
        normals: Any = None,
        radius: Any = None,
        values: Any = None,
        opacities: Any = None,
        columns: Mapping[str, Any] | None = None,
        color_by: str | None = None,
        colormap: str | None = None,
        clim: tuple[float, float] | None = None,
        log_scale: bool = False,
        name: str | None = None,
        **keys: Any,
    ) -> None:
        """Adds points.

        Parameters
        ----------
        positions
            (n, 3), any numbers.
        colors
            (n, 3): linear numbers from 0 on, or bytes of sRGB.
        normals
            (n, 3); found from neighbours where there are none.
        radius
            (n,) or one number: the radius of a point's disc, in the unit of the positions; found from neighbours where it is None.
        values
            (n,): a column that ``color_by="value"`` shows.
        opacities
            (n,), from 0 to 1.
        columns
            Further columns by name, (n,) each.
        color_by
            The column that colours stand for: ``"value"``, one of ``columns``, ``"x"``, ``"y"``, ``"z"`` or ``"height"``; ``values`` where they are given
            without colours.
        colormap, clim
            Its map and the numbers at the two ends of it.
        log_scale
            Whether numbers lie along the map by their logarithms; those that are not above 0 have the object's colour.
        name
            How the object is called.
        **keys
            Further keys of an object (docs/scene.md), such as ``opacity``, ``material``, ``technique``, ``unlit``.
        """
        held = dict(columns or {})
        if radius is not None:
            count = len(positions)
            held["radius"] = np.broadcast_to(np.asarray(radius, dtype=float), (count,))
        data = Data.points(
            _array(positions), _array(normals), _colors(colors), _array(opacities), _array(values), _arrays(held)
        )
        if color_by is None and values is not None and colors is None:
            color_by = "value"
        if color_by is not None:
            shown: dict[str, Any] = {"column": color_by}
            if colormap is not None:
                shown["map"] = colormap
            if clim is not None:
                shown["range"] = [float(end) for end in clim]
            if log_scale:
                shown["scale"] = "log"
            keys = {"color_by": shown} | keys
        elif colormap is not None or clim is not None or log_scale:
            raise InputError("colormap, clim, log_scale: expected a column to colour by, found none; give `values` or `color_by`")
        self._add("points", data, name, keys)

    def add_mesh(
        self, vertices: Any, faces: Any, *, normals: Any = None, colors: Any = None, name: str | None = None, **keys: Any
    ) -> None:
        """Adds a mesh.

        Parameters
        ----------
        vertices
            (n, 3), any numbers.
        faces
            (m, 3), or (m, 4) for four-sided ones: indices of vertices, from 0.
        normals
            (n, 3); smooth ones are found where there are none.
        colors
            (n, 3): linear numbers from 0 on, or bytes of sRGB.
        name, **keys
            As for :meth:`add_points`.
        """
        corners = _array(faces)
        if corners.ndim == 2 and corners.shape[1] == 4:
            corners = np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])
        data = Data.mesh(_array(vertices), corners, _array(normals), _colors(colors))
        self._add("mesh", data, name, keys)

    def add_volume(
        self,
        values: Any,
        *,
        spacing: Any = 1.0,
        origin: Any = (0.0, 0.0, 0.0),
        direction: Any = None,
        transfer: Transfer | None = None,
        preset: str | None = None,
        name: str | None = None,
        **keys: Any,
    ) -> None:
        """Adds a volume.

        Parameters
        ----------
        values
            (nz, ny, nx), any numbers; NaN is a gap that shows nothing.
        spacing
            The steps along x, y and z, or one number for all.
        origin
            The place of ``values[0, 0, 0]``: x, y, z.
        direction
            Columns: the directions of the steps along x, y and z; those of the axes where it is None.
        transfer
            What values show, from :func:`organza.transfer`; one that fits the values where it is None.
        preset
            Instead of ``transfer``, a look by its name, such as ``"ct-bone"``, ``"mri"``, ``"cloud"`` or a map.
        name, **keys
            As for :meth:`add_points`. Without a ``material`` a volume is lit by its gradients, as a first scene has it.
        """
        grid = _array(values)
        steps = np.asarray(spacing, dtype=float)
        if steps.shape not in ((), (3,)):
            raise InputError(f"spacing: expected one number or three, found the shape {steps.shape}")
        steps = np.broadcast_to(steps, (3,))
        if transfer is not None and not isinstance(transfer, Transfer):
            raise InputError(f"transfer: expected what organza.transfer makes, found {type(transfer).__name__}; `preset` takes a name")
        turn = np.eye(3) if direction is None else np.asarray(direction, dtype=float).reshape(3, 3)
        data = Data.grid(grid, steps.tolist(), np.asarray(origin, dtype=float).tolist(), turn.tolist())
        if transfer is not None and preset is not None:
            raise InputError("transfer, preset: expected one of them, found both")
        if transfer is not None:
            diagonal = float(np.linalg.norm(steps * (np.array(grid.shape[::-1]) - 1)))
            keys = transfer.keys(diagonal or 1.0) | keys
            if "material" not in keys:
                # As first scenes have it: lit by its gradients, so that its shape is seen.
                self._document.setdefault("material", {}).setdefault(_LIT_VOLUME, _LIT)
                keys = {"material": _LIT_VOLUME} | keys
        elif "transfer" not in keys:
            keys = self._first_keys(data, name or "volume", preset) | keys
        self._add("volume", data, name, keys)

    def add(self, thing: Any, *, name: str | None = None, **keys: Any) -> None:
        """Adds a file, or a data set of another library: PyVista and VTK (points, surfaces, images), trimesh, Open3D, xarray, nibabel, SimpleITK; or an
        array: (n, 3) are points, and one of three axes is a volume.

        Parameters
        ----------
        thing
            What to add.
        name, **keys
            As for :meth:`add_points`.
        """
        if isinstance(thing, (str, os.PathLike)):
            first = scene_of((os.path.abspath(thing),), _no_wish(), _how())
            self._take(first, name, keys)
            return
        adopted.add(self, thing, name, keys)

    # Everything else.

    def set(self, key: str, value: Any) -> None:
        """Sets a key of docs/scene.md, such as ``scene.set("render.technique", "surfels")`` or ``scene.set("object.scan.opacity", 0.5)``; objects and lights
        are named, materials too."""
        self._check_open()
        place: Any = self._document
        parts = key.split(".")
        if not all(parts) or value is None:
            raise InputError(f"{key!r}: expected a key and a value, such as 'render.technique' and 'surfels', found {value!r}")
        for part, following in zip(parts, parts[1:] + [""]):
            if part in ("object", "light") and place is self._document:
                place = place.setdefault(part, [])
                continue
            if isinstance(place, list):
                place = _named(place, part, key)
                continue
            if not following:
                place[part] = _plain(value)
                return
            place = place.setdefault(part, {})
        raise InputError(f"{key}: expected a key of an object or a light, found its name alone")

    def camera(
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
        """Places the camera: at ``position`` looking at ``target``, or so that all is seen from an ``azimuth`` about +Y and an ``elevation`` (degrees)."""
        self._check_open()
        camera = self._document.setdefault("camera", {})
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
        camera.update({key: _plain(value) for key, value in stated.items() if value is not None})

    def light(self, kind: str = "directional", *, name: str | None = None, **keys: Any) -> None:
        """Adds a light, such as ``scene.light(direction=(-1, -2, -1), irradiance=(3, 3, 3), name="sun")``; ``kind`` and keys as in docs/scene.md."""
        self._check_open()
        named = {} if name is None else {"name": name}
        self._document.setdefault("light", []).append({"kind": kind} | named | _plain(keys))

    def material(self, name: str, **keys: Any) -> None:
        """States a material, which objects name by ``material="NAME"``; keys as in docs/scene.md."""
        self._check_open()
        self._document.setdefault("material", {})[name] = _plain(keys)

    def to_toml(self) -> str:
        """The scene as the text of a scene file. Data from arrays is named ``memory:NAME`` in it, which a file cannot hold."""
        if self._text is not None:
            return self._text
        return _organza.toml_text(json.dumps(self._document))

    @property
    def objects(self) -> list[str]:
        """Names of its objects."""
        return [thing["name"] for thing in self._document.get("object", [])]

    @property
    def notes(self) -> list[str]:
        """What a first scene decided that a user may want otherwise, one sentence each."""
        return list(self._remarks)

    def __repr__(self) -> str:
        return f"<organza.Scene {self._file}>" if self._text else f"<organza.Scene of {', '.join(self.objects) or 'nothing'}>"

    def __getstate__(self) -> dict[str, Any]:
        data = {name: (data.kind, data.arrays()) for name, data in self._data.items()}
        return {"document": self._document, "text": self._text, "file": self._file, "data": data, "remarks": self._remarks, "written": self._written}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self._document = state["document"]
        self._text = state["text"]
        self._file = state["file"]
        self._remarks = state["remarks"]
        self._written = state["written"]
        self._data = {name: getattr(Data, kind)(**arrays) for name, (kind, arrays) in state["data"].items()}

    def _check_open(self) -> None:
        if self._text is not None:
            raise InputError(f"{self._file}: a scene that was loaded stays as its file has it; change the file")

    def _add(self, source: str, data: Data, name: str | None, keys: Mapping[str, Any]) -> None:
        self._check_open()
        if name is not None and not isinstance(name, str):
            raise InputError(f"name: expected a text, found {name!r}")
        label = self._free_name(name or source)
        _organza.check(label, data)
        self._data[label] = data
        thing = {"name": label, source: _MEMORY + label} | _plain(dict(keys))
        self._document.setdefault("object", []).append(thing)

    def _free_name(self, name: str) -> str:
        return _free(name, self.objects)

    def _first_keys(self, data: Data, name: str, preset: str | None) -> dict[str, Any]:
        """What a first scene says of a volume; its material becomes one of this scene."""
        text, _, _ = _organza.first_scene([(name, data, "y")], _no_wish() | {"preset": preset}, _how())
        first = json.loads(text)
        thing = first["object"][0]
        keys = {key: value for key, value in thing.items() if key not in ("name", "volume")}
        self._take_material(first, keys, name)
        return keys

    def _take(self, first: Scene, name: str | None, keys: Mapping[str, Any]) -> None:
        """Takes the objects of a first scene."""
        self._check_open()
        self._remarks += first._remarks
        for thing in first._document.get("object", []):
            thing = dict(thing)
            self._take_material(first._document, thing, thing["name"])
            thing["name"] = self._free_name(name or thing["name"])
            self._document.setdefault("object", []).append(thing | _plain(dict(keys)))

    def _take_material(self, first: Mapping[str, Any], thing: dict[str, Any], name: str) -> None:
        material = thing.get("material")
        if material is not None and material in first.get("material", {}):
            own = f"{material} of {name}"
            self._document.setdefault("material", {})[own] = first["material"][material]
            thing["material"] = own

    def _given(
        self,
        how: dict[str, Any],
        effects: Mapping[str, str] | None,
        size: tuple[int, int] | None,
        transparent: bool = False,
    ) -> dict[str, Any]:
        """The scene as the extension takes it, with what it does not state."""
        switches = [f"{name}={state}" for name, state in (effects or {}).items()]
        given: dict[str, Any] = {
            "text": self._text,
            "file": self._file,
            "data": self._data,
            "effects": switches,
            "changes": [],
            "size": size,
            "transparent": transparent,
            "frame": None,
            "turntable": None,
        }
        if self._text is not None:
            return given
        if self._written is not None and self._written.document == self._document:
            # A size that it states already is no change of it.
            is_stated = size is not None and list(size) == self._document.get("camera", {}).get("size")
            return given | {"text": self._written.text, "file": self._written.file, "size": None if is_stated else size}
        document = copy.copy(self._document)
        camera = dict(document.get("camera", {}))
        if "position" not in camera:
            camera.setdefault("auto", True)
        camera.setdefault("size", list(_DEFAULT_SIZE))
        document["camera"] = camera
        if "light" not in document and "ambient" not in document:
            given["text"] = json.dumps(document)
            unswitched = given | {"effects": [], "transparent": False}
            document |= json.loads(_organza.lights_of(unswitched, how))
        return given | {"text": json.dumps(document)}


def scene_of(what: tuple[Any, ...], wished: Mapping[str, Any], how: dict[str, Any]) -> Scene:
    """A scene, or the first scene of files and data."""
    if not what:
        raise InputError("what: expected a scene, files or data, found nothing")
    wishes = {key: value for key, value in wished.items() if value and key not in ("size", "turntable")}
    if len(what) == 1 and (isinstance(what[0], Scene) or _is_scene(what[0])):
        if wishes:
            raise InputError(f"{', '.join(wishes)}: expected data, found a scene, which states that itself")
        return what[0] if isinstance(what[0], Scene) else Scene.load(what[0])
    shown: list[Any] = []
    data_by_name: dict[str, Data] = {}
    for thing in what:
        if isinstance(thing, Scene) or _is_scene(thing):
            raise InputError(f"what: expected one scene, or files and data, found a scene among {len(what)}")
        if isinstance(thing, (str, os.PathLike)):
            shown.append(os.path.abspath(thing))
            continue
        name, data, up = adopted.data_of(thing)
        name = _free(name, data_by_name)
        data_by_name[name] = data
        shown.append((name, data, up))
    text, remarks, written = _organza.first_scene(shown, dict(wished), how)
    scene = Scene()
    scene._document = json.loads(text)
    scene._data = data_by_name
    scene._remarks = remarks
    # A scene may be drawn in another working folder than it was made in.
    for first in scene._document.get("object", []):
        for source in _SOURCES:
            if source in first and not first[source].startswith(_MEMORY):
                first[source] = os.path.abspath(first[source])
    scene._written = _Written(copy.deepcopy(scene._document), written, os.path.abspath(_FIRST))
    return scene


def _free(name: str, taken: Container[str]) -> str:
    """A name that is not taken."""
    free = name
    number = 2
    while free in taken:
        free = f"{name} {number}"
        number += 1
    return free


def _is_scene(thing: Any) -> bool:
    """Whether a thing is the path of a scene file: TOML, or JSON that says so."""
    if not isinstance(thing, (str, os.PathLike)):
        return False
    path = Path(thing)
    if path.suffix.lower() == ".toml":
        return True
    return path.suffix.lower() == ".json" and path.is_file() and b'"version"' in path.read_bytes()[:4096]


def _array(thing: Any) -> Any:
    """An array of a kind of numbers that the extension takes; None stays None."""
    if thing is None:
        return None
    if isinstance(thing, np.ma.MaskedArray) and np.ma.is_masked(thing):
        # A gap, as NaN is.
        thing = np.where(np.ma.getmaskarray(thing), np.nan, thing.data)
    try:
        array = np.asarray(thing)
    except ValueError as error:
        raise InputError(f"expected an array of numbers, found rows of other lengths ({error})") from None
    if array.dtype in (np.float16, np.bool_) or array.dtype.byteorder not in ("=", "|"):
        return array.astype(np.uint8 if array.dtype == np.bool_ else array.dtype.newbyteorder("=").char.replace("e", "f"))
    return array


def _colors(thing: Any) -> Any:
    """Colours: linear numbers, or bytes of sRGB; whole numbers of another kind may be either."""
    array = _array(thing)
    if array is not None and np.issubdtype(array.dtype, np.integer) and array.dtype != np.uint8:
        raise InputError(f"colors: expected linear numbers with a point, or bytes (uint8) of sRGB, found {array.dtype}")
    return array


def _arrays(columns: Mapping[str, Any]) -> dict[str, Any]:
    return {str(name): _array(values) for name, values in columns.items()}


def _plain(value: Any) -> Any:
    """A value as JSON has it."""
    if isinstance(value, Mapping):
        return {str(key): _plain(part) for key, part in value.items()}
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        raise InputError(f"expected finite numbers, found {value}")
    if isinstance(value, Transfer):
        raise InputError("a transfer: expected it as `transfer=` of add_volume, found it as a key")
    if isinstance(value, (list, tuple)):
        return [_plain(part) for part in value]
    return value


def _named(things: list[dict[str, Any]], part: str, key: str) -> dict[str, Any]:
    for place, thing in enumerate(things):
        if thing.get("name") == part or str(place) == part:
            return thing
    known = ", ".join(str(thing.get("name", place)) for place, thing in enumerate(things)) or "none"
    raise InputError(f"{key}: expected one of {known}, found '{part}'")


def _how() -> dict[str, Any]:
    return {"threads": None, "max_memory": None, "progress": None, "drop_invalid": False, "strict": False}


def _no_wish() -> dict[str, Any]:
    return {
        "size": None,
        "preset": None,
        "color_by": None,
        "up": None,
        "ground": False,
        "azimuth": None,
        "elevation": None,
        "fit": None,
        "turntable": None,
    }
