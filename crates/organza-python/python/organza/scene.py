"""Scenes: data, a camera, lights and materials, as a document that can be looked at and changed."""

from __future__ import annotations

import copy
import functools
import json
import math
import os
import re
from collections.abc import Container, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from organza import _organza, adopted
from organza._organza import Data, InputError
from organza.arrays import array_of, color_of, colors_of, columns_of, halved_quads, is_told_apart, plain, radii_of, texture_of
from organza.checking import check_keys, meant, of_object
from organza.fields import Field, field_of
from organza.lattices import check_level, check_plane, lattice_of, percentiles, volume_arguments
from organza.paths import path_in
from organza.placing import Camera, Light, beyond
from organza.transfers import Transfer, clim_of, is_named
from organza.transfers import transfer as make_transfer
from organza.values import flag, kind_of, number, place_of, sides_of, text

_DEFAULT_SIZE = (960, 540)
# The largest label: whole numbers up to it are exact in single precision.
_MOST_LABELS = 2**24
# The material of slices that name none: the colours of their map, as they are.
_UNLIT_SLICE = "unlit slice"
# The material of volumes that name none.
_LIT_VOLUME = "lit volume"
_LIT = {"shading": "phong", "specular": 0.08, "shininess": 24}
# The material of surfaces that are `unlit`, a key which scenes have for points alone.
_UNLIT_SURFACE = "unlit surface"
# Materials that objects name without their being stated.
_MADE_MATERIALS: dict[str, dict[str, Any]] = {_UNLIT_SLICE: {"shading": "unlit"}, _UNLIT_SURFACE: {"shading": "unlit"}, _LIT_VOLUME: _LIT}
# Sources whose objects are surfaces.
_SURFACES = ("mesh", "isosurface")
# A scene that is made here lies nowhere: files that it names are relative to the working folder.
_NOWHERE = "scene.json"
# A first scene lies in the working folder, as far as its paths go.
_FIRST = "scene.toml"
# Light enough for shadows to show.
_GROUND_COLOR = (0.32, 0.32, 0.33)
# Steps of a ground's splats along a side, as the ground of a first scene has them.
_GROUND_STEPS = 320.0
# A place for a ground, whose own is found when the scene is drawn.
_ANYWHERE = {"rectangle": {"center": [0.0, 0.0, 0.0], "u": [1.0, 0.0, 0.0], "v": [0.0, 0.0, 1.0], "spacing": 0.1}}
# Sources of a first scene, and how one names data in memory.
_SOURCES = ("mesh", "points", "volume")
_MEMORY = "memory:"


@dataclass(frozen=True)
class _Written:
    """A first scene as the command writes it, which is drawn as long as its document is not changed: a file then has the picture of the command."""

    document: dict[str, Any]
    text: str
    file: str


@dataclass(frozen=True)
class _Ground:
    """A ground that is placed when the scene is drawn."""

    name: str
    size: float | None
    height: float | None


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
        self._ground: _Ground | None = None
        # Objects that the camera of a first scene does not see in whole, and the share that it misses.
        self._beyond: dict[str, float] = {}

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Scene:
        """A scene file as it is. It can be drawn and its effects switched; to change more of it, change the file."""
        scene = cls()
        scene._file = os.fspath(path)
        if scene._file == _NOWHERE:
            # A file of that name has lines, which its errors name.
            scene._file = os.path.join(os.curdir, _NOWHERE)
        if Path(path).suffix.lower() not in (".toml", ".json"):
            raise InputError(f"{os.fspath(path)}: expected a scene, .toml or .json; Scene.from_files takes data files")
        scene._text = Path(path).read_text(encoding="utf-8")
        return scene

    @classmethod
    def from_files(cls, *paths: str | os.PathLike[str], **wishes: Any) -> Scene:
        """A first scene of data files, as ``organza init`` writes it; ``wishes`` are those of :func:`organza.render`: ``preset``, ``color_by``, ``up`` …"""
        known = [wish for wish in _no_wish() if wish != "turntable"]
        for wish in wishes:
            if wish not in known:
                raise TypeError(f"from_files: expected one of {', '.join(known)}, found `{wish}`{meant(wish, known)}")
        return scene_of(paths, _no_wish() | wishes, _how())

    # Data.

    @of_object
    def add_points(
        self,
        positions: Any,
        *,
        colors: Any = None,
        normals: Any = None,
        radius: Any = None,
        values: Any = None,
        opacities: Any = None,
        columns: Any = None,
        color_by: str | None = None,
        colormap: Any = None,
        clim: tuple[float | None, float | None] | None = None,
        log_scale: bool = False,
        field: Any = None,
        transfer: Transfer | None = None,
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
            (n,) or one number: the radius of a point's disc or ball, in the unit of the positions; found from neighbours where it is None. Opaque points without
            normals are balls where most of them lie on no surface, as particles of a simulation do; ``discs="balls"`` and ``"round"`` say so or not.
        values
            (n,): a column that ``color_by="value"`` shows. Light changes its colours: ``unlit=True`` shows those of the legend.
        opacities
            (n,), from 0 to 1.
        columns
            Further columns by name, (n,) each: a mapping such as ``{"heat": array}``, or a data frame of pandas.
        color_by
            The column that colours stand for: ``"value"``, one of ``columns``, ``"x"``, ``"y"``, ``"z"`` or ``"height"``; ``values`` where they are given
            without colours.
        colormap, clim
            Its map, as for :func:`organza.transfer`, and the numbers at the two ends of it; the 1st and the 99th percentile of the column in the place of None, of
            both or of one of them. Only ``unlit=True`` shows the very colours of the map.
        log_scale
            Whether numbers lie along the map by their logarithms; those that are not above 0 have the object's colour.
        field
            As for :meth:`add_isosurface`: a volume whose values they show. An array has its first value at the origin and steps of 1; a table states others.
        transfer
            Instead of a map, what :func:`organza.transfer` makes, for the column or the field; its opacities are not used.
        name
            How the object is called; no other object of the scene may have the name.
        **keys
            Further keys of an object (docs/scene.md), such as ``opacity``, ``material``, ``technique``, ``unlit``, ``discs``.

        Raises
        ------
        InputError
            For arrays of another shape, names and keys that there are not, and values that they cannot have.
        """
        _check_array("positions", positions)
        _check_finite("positions", positions)
        if isinstance(values, str):
            raise InputError(f"values: expected an array of numbers, found the text {values!r}; `color_by={values!r}` shows a column of `columns`")
        _check_finite("values", values)
        check_keys(Scene.add_points, name or "points", keys)
        held = columns_of(columns)
        if radius is not None:
            held["radius"] = radii_of(radius, len(positions))
        places = array_of(positions, "positions")
        shown_values = array_of(values, "values")
        if values is not None and "value" in held:
            raise InputError("values, columns: expected the column `value` once, found both; name it otherwise in `columns`")
        if np.ndim(shown_values) == 1 and not is_told_apart(shown_values):
            # A column has double precision.
            held["value"] = shown_values
            shown_values = None
        data = Data.points(
            places, array_of(normals, "normals"), colors_of(colors), array_of(opacities, "opacities"), shown_values, held
        )
        if color_by is None and values is not None and colors is None and field is None:
            color_by = "value"
        numbers = _axes(places) | held | ({} if shown_values is None else {"value": shown_values})
        shown, colors_by = _colors_by(color_by, colormap, clim, log_scale, field, transfer, numbers)
        keys = colors_by | keys
        self._add("points", data, name, keys, field=shown)
        self._note_beyond(self.objects[-1], positions, keys)

    @of_object
    def add_mesh(
        self,
        vertices: Any,
        faces: Any = None,
        *,
        normals: Any = None,
        colors: Any = None,
        opacities: Any = None,
        uv: Any = None,
        texture: Any = None,
        values: Any = None,
        columns: Any = None,
        color_by: str | None = None,
        colormap: Any = None,
        clim: tuple[float | None, float | None] | None = None,
        log_scale: bool = False,
        field: Any = None,
        transfer: Transfer | None = None,
        name: str | None = None,
        **keys: Any,
    ) -> None:
        """Adds a mesh.

        Parameters
        ----------
        vertices
            (n, 3), any numbers.
        faces
            (m, 3), or (m, 4) for four-sided ones: indices of vertices, from 0.
        normals
            (n, 3); smooth ones are found where there are none. Vertices at one place count as one vertex for them, also where rounding parts them.
        colors
            (n, 3): linear numbers from 0 on, or bytes of sRGB. Beside a texture they are multiplied by its colours.
        opacities
            (n,), from 0 to 1.
        uv
            Places in the texture, (n, 2), or (m, 3, 2) and (m, 4, 2) for one at each corner of a face: (0, 0) is the lower left corner of the image, (1, 1)
            its upper right, as in OBJ files.
        texture
            The image: the path of a PNG or JPEG file; or an array (height, width, 3) or (height, width, 4), from the top left, of bytes or ``uint16`` of
            sRGB, or linear numbers; or an image of Pillow. It repeats beyond its borders. A fourth channel is the opacity of the surface.
        values
            (n,) of vertices or (m,) of faces: a column that ``color_by="value"`` shows. Where there are as many vertices as faces, it is of the vertices. Light
            changes its colours: ``unlit=True`` shows those of the legend.
        columns
            Further columns by name, as ``values``.
        color_by
            The column that colours stand for: ``"value"``, one of ``columns``, ``"x"``, ``"y"``, ``"z"`` or ``"height"``; ``values`` where they are given
            without colours and texture.
        colormap, clim, log_scale, field, transfer
            As for :meth:`add_points`.
        name, **keys
            As for :meth:`add_points`.

        Raises
        ------
        InputError
            An array of another shape, a name or a key that there is not, an index that no vertex has, ``uv`` without ``texture``, or an image that cannot be read.
        FileNotFoundError
            A texture that is not there.
        """
        _check_array("vertices", vertices)
        if faces is None:
            raise InputError("faces: expected indices of vertices, of the shape (m, 3) or (m, 4), found none; add_points takes vertices alone")
        _check_finite("vertices", vertices)
        _check_faces(faces)
        if isinstance(values, str):
            raise InputError(f"values: expected an array of numbers, found the text {values!r}; `color_by={values!r}` shows a column of `columns`")
        _check_finite("values", values)
        _check_array("faces", faces)
        check_keys(Scene.add_mesh, name or "mesh", keys)
        corners = array_of(faces, "faces")
        places = array_of(uv, "uv")
        shape = array_of(vertices, "vertices")
        count = len(corners) if np.ndim(corners) else 0
        is_of_quads = np.ndim(corners) == 2 and corners.shape[1] == 4
        if is_of_quads:
            corners = halved_quads(corners)
            if np.ndim(places) == 3 and places.shape[1] == 4:
                places = halved_quads(places)
        of_vertices: dict[str, Any] = {}
        of_faces: dict[str, Any] = {}
        vertex_count = len(shape) if np.ndim(shape) else 0
        numbers = ({} if values is None else {"value": array_of(values, "values")}) | columns_of(columns)
        for column, array in numbers.items():
            if np.shape(array) not in ((vertex_count,), (count,)):
                argument = "values" if column == "value" else f"columns, '{column}'"
                raise InputError(f"{argument}: expected the shape ({vertex_count},) of vertices or ({count},) of faces, found {np.shape(array)}")
            if len(array) == count and count != vertex_count:
                of_faces[column] = np.concatenate([array, array]) if is_of_quads else array
            else:
                of_vertices[column] = array
        data = Data.mesh(
            shape,
            corners,
            normals=array_of(normals, "normals"),
            colors=colors_of(colors),
            opacities=array_of(opacities, "opacities"),
            columns=of_vertices,
            face_columns=of_faces,
            uv=places,
            texture=texture_of(texture),
        )
        if color_by is None and values is not None and colors is None and texture is None and field is None:
            color_by = "value"
        shown, colors_by = _colors_by(color_by, colormap, clim, log_scale, field, transfer, _axes(shape) | numbers)
        keys = colors_by | keys
        self._add("mesh", data, name, keys, field=shown)
        self._note_beyond(self.objects[-1], vertices, keys)

    @of_object
    def add_volume(
        self,
        values: Any,
        *,
        spacing: Any = None,
        origin: Any = None,
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
            (nz, ny, nx), any numbers, of which NaN is a gap that shows nothing; or a volume of xarray, nibabel, SimpleITK or PyVista, which brings its steps and
            its place; or the path of a file.
        spacing
            The steps along x, y and z, or one number for all; 1 where neither this nor the data says others. Beside a file the key ``voxel_size`` states them.
        origin
            The place of ``values[0, 0, 0]``: x, y, z; (0, 0, 0) where neither this nor the data says another.
        direction
            Columns: the directions of the steps along x, y and z; those of the axes where it is None.
        transfer
            What values show, from :func:`organza.transfer`, whose ``clim`` may be left to the values; one that fits the values where it is None.
        preset
            Instead of ``transfer``, a look by its name, such as ``"ct-bone"``, ``"mri"``, ``"cloud"`` or a map.
        name, **keys
            As for :meth:`add_points`. Without a ``material`` a volume is lit by its gradients, as a first scene has it.
        """
        check_keys(Scene.add_volume, name or "volume", keys)
        _check_look(transfer, preset)
        if keys.get("labels") is not None and transfer is None and preset is None:
            preset = "labels"
        if isinstance(values, (str, os.PathLike)):
            stated = {"spacing": spacing, "origin": origin, "direction": direction}
            for argument, value in stated.items():
                if value is not None:
                    raise InputError(f"{argument}: expected none beside a file, which has its own, found {value!r}; `voxel_size` and `transform` change these")
            first = scene_of((os.path.abspath(values),), _no_wish() | {"preset": preset}, _how())
            self._take(first, name, keys, transfer, "volume")
            return
        arguments, standing = volume_arguments(values, spacing, origin, direction)
        keys = standing | keys
        data, lattice = lattice_of(**arguments)
        source = "volume"
        if transfer is not None:
            ends = transfer.ends(lambda: percentiles(arguments["values"]))
            keys = transfer.keys(lattice.diagonal or 1.0, ends) | keys
            if "material" not in keys:
                # As first scenes have it: lit by its gradients, so that its shape is seen.
                keys = {"material": _LIT_VOLUME} | keys
        elif "transfer" not in keys:
            source, found = self._first_keys(data, name or "volume", preset)
            keys = _without_colors(found, keys) | keys
        self._add(source, data, name, keys)
        self._note_beyond(self.objects[-1], lattice.corners, keys)

    @of_object
    def add_isosurface(
        self,
        values: Any,
        level: float,
        *,
        inside: str = "above",
        field: Any = None,
        colormap: Any = None,
        clim: tuple[float | None, float | None] | None = None,
        transfer: Transfer | None = None,
        spacing: Any = None,
        origin: Any = None,
        direction: Any = None,
        name: str | None = None,
        **keys: Any,
    ) -> None:
        """Adds the surface on which a volume has a value.

        Parameters
        ----------
        values
            (nz, ny, nx), any numbers; or a volume of xarray, nibabel, SimpleITK or PyVista, which brings its steps and its place; or the path of a file.
        level
            The value.
        inside
            ``"above"``, so that the surface faces lower values, or ``"below"``.
        field
            Another volume, whose values the surface shows: an array, which has the steps and the place of ``values``; a volume of another library, or the path
            of a file, which have their own; or a table ``{"values": …, "spacing": …, "origin": …, "direction": …, "interpolation": "catmull-rom"}``. Both
            have the same axes. Where the surface leaves the field it has its own colour, and a warning tells the share.
        colormap, clim
            The map of the field's colours, ``"viridis"`` where it is None, and the field's values at its two ends: its 1st and 99th percentile where ``clim``
            is None. Light changes the colours: ``unlit=True`` shows those of the legend.
        transfer
            Instead of these, what :func:`organza.transfer` makes; its opacities are not used.
        spacing, origin, direction
            As for :meth:`add_volume`.
        name, **keys
            As for :meth:`add_points`, such as ``color`` and ``opacity``.

        Raises
        ------
        InputError
            For what is no volume, a level that is not finite, and a field of a file without ``clim``.
        """
        if "color_by" in keys:
            raise InputError(f"color_by: an isosurface has no columns, found {_kind(keys['color_by'])}; `field` takes a volume whose values it shows")
        check_keys(Scene.add_isosurface, name or "isosurface", keys)
        if field is None and not (colormap is None and clim is None and transfer is None):
            raise InputError("colormap, clim, transfer: expected a `field` to colour by, found none; `color` takes one colour")
        if not isinstance(inside, str) or inside not in ("above", "below"):
            raise InputError(f"inside: expected 'above' or 'below', found {inside!r}")
        height = number("level", level)
        table = {"level": height, "inside": inside}
        if isinstance(values, (str, os.PathLike)):
            shown = None if field is None else field_of(field, {}, colormap, clim, transfer)
            self._add_file("isosurface", values, table, name, keys, shown)
            return
        arguments, standing = volume_arguments(values, spacing, origin, direction)
        data, lattice = lattice_of(**arguments)
        check_level(height, arguments["values"])
        own = {key: value for key, value in arguments.items() if key != "values"}
        shown = None if field is None else field_of(field, own, colormap, clim, transfer, shape=np.shape(array_of(arguments["values"], "values")))
        self._add("isosurface", data, name, standing | keys, table, shown)
        self._note_beyond(self.objects[-1], lattice.corners, standing | keys)

    @of_object
    def add_slice(
        self,
        values: Any,
        *,
        normal: Any = "z",
        center: Any = None,
        colormap: Any = "grey",
        clim: tuple[float | None, float | None] | None = None,
        transfer: Transfer | None = None,
        spacing: Any = None,
        origin: Any = None,
        direction: Any = None,
        name: str | None = None,
        **keys: Any,
    ) -> None:
        """Adds a plane through a volume in the colours of its values, as they are, without light.

        Parameters
        ----------
        values
            As for :meth:`add_isosurface`.
        normal
            What the plane lies across: ``"x"``, ``"y"``, ``"z"``, or three numbers.
        center
            A point of the plane: x, y, z; the middle of the volume where it is None.
        colormap, clim
            The map of the colours, and the values at its two ends; the 1st and 99th percentile where ``clim`` is None.
        transfer
            Instead of these, what :func:`organza.transfer` makes; its opacities are not used.
        spacing, origin, direction
            As for :meth:`add_volume`.
        name, **keys
            As for :meth:`add_points`.

        Raises
        ------
        InputError
            For what is no volume, and for a file without ``center`` or colours.
        """
        if "field" in keys:
            raise InputError("field: a slice shows the values of its own volume, found another; give `values` the volume that it shows")
        check_keys(Scene.add_slice, name or "slice", keys)
        axes = {"x": [1.0, 0.0, 0.0], "y": [0.0, 1.0, 0.0], "z": [0.0, 0.0, 1.0]}
        if isinstance(normal, str) and normal not in axes:
            raise InputError(f"normal: expected 'x', 'y', 'z' or three numbers, found {normal!r}")
        if transfer is not None and not isinstance(transfer, Transfer):
            raise InputError(f"transfer: expected what organza.transfer makes, found {type(transfer).__name__}; `colormap` takes a name")
        across = axes[normal] if isinstance(normal, str) else place_of("normal", normal)
        is_file = isinstance(values, (str, os.PathLike))
        colors = transfer if transfer is not None else make_transfer(colormap, clim)
        if is_file and (center is None or None in colors.clim):
            raise InputError("center, clim: expected both for the slice of a file, which is not read yet; or give its values")
        table: dict[str, Any] = {"normal": across}
        standing: dict[str, Any] = {}
        if not is_file:
            arguments, standing = volume_arguments(values, spacing, origin, direction)
            data, lattice = lattice_of(**arguments)
            center = lattice.middle if center is None else center
        table["center"] = place_of("center", center)
        if not is_file:
            check_plane(table["center"], across, lattice.corners)
        points = colors.colors_over(colors.ends(lambda: percentiles(arguments["values"])))
        if "material" not in keys:
            keys = {"material": _UNLIT_SLICE} | keys
        keys = standing | {"transfer": points} | keys
        if is_file:
            self._add_file("slice", values, table, name, keys)
        else:
            self._add("slice", data, name, keys, table)

    @of_object
    def add_labels(
        self,
        values: Any,
        *,
        labels: Any = None,
        field: Any = None,
        colormap: Any = None,
        clim: tuple[float | None, float | None] | None = None,
        transfer: Transfer | None = None,
        spacing: Any = None,
        origin: Any = None,
        direction: Any = None,
        name: str | None = None,
        **keys: Any,
    ) -> None:
        """Adds a volume of labels: the surface of each region, in its own colour.

        Parameters
        ----------
        values
            As for :meth:`add_isosurface`: whole numbers, of which 0 is nothing.
        labels
            What the numbers stand for: ``{1: "bone", 2: {"name": "skin", "color": "#e6c8a0", "opacity": 0.3}, 3: {"visible": False}}``, or the path of a
            table of colours. Names stand in the legend of :meth:`Picture.save`, ``"visible": False`` hides a region, and regions that are not named have
            colours of their numbers. Without it each region has one of twelve colours.
        field, colormap, clim, transfer
            As for :meth:`add_isosurface`: the intensities that surfaces of the regions show; not together with ``labels``.
        spacing, origin, direction
            As for :meth:`add_volume`.
        name, **keys
            As for :meth:`add_points`.

        Raises
        ------
        InputError
            For what is no volume, or not of whole numbers.
        """
        check_keys(Scene.add_labels, name or "mesh", keys)
        if field is None and not (colormap is None and clim is None and transfer is None):
            raise InputError("colormap, clim, transfer: expected a `field` to colour by, found none; `labels` takes the colours of regions")
        if field is not None and labels is not None:
            raise InputError("labels, field: expected one of them, found both: the surfaces show the field or the colours of labels")
        table = os.path.abspath(labels) if isinstance(labels, (str, os.PathLike)) else labels
        looks: dict[str, Any] = {"color_by": {"column": "label", "map": "distinct"}} if table is None else {"labels": table}
        looks = {} if field is not None else looks
        if isinstance(values, (str, os.PathLike)):
            shown = None if field is None else field_of(field, {}, colormap, clim, transfer)
            self._add_file("mesh", values, None, name, looks | keys, shown)
            return
        arguments, standing = volume_arguments(values, spacing, origin, direction)
        numbers = array_of(arguments["values"], "values")
        _check_labels(numbers)
        data, lattice = lattice_of(**(arguments | {"values": numbers}))
        own = {key: value for key, value in arguments.items() if key != "values"}
        shown = None if field is None else field_of(field, own, colormap, clim, transfer, shape=np.shape(numbers))
        missing = _missing_labels(labels, numbers)
        self._add("mesh", data, name, standing | looks | keys, field=shown)
        if missing:
            self._remarks.append(f"{self.objects[-1]}: `labels` names {', '.join(missing)}, which no voxel has")
        self._note_beyond(self.objects[-1], lattice.corners, standing | keys)

    @of_object
    def add(
        self,
        thing: Any,
        *,
        preset: str | None = None,
        transfer: Transfer | None = None,
        color_by: Any = None,
        colormap: Any = None,
        clim: tuple[float | None, float | None] | None = None,
        log_scale: bool = False,
        up: str | None = None,
        name: str | None = None,
        **keys: Any,
    ) -> None:
        """Adds a file, or a data set of another library: PyVista and VTK (points, surfaces, images), trimesh, Open3D, xarray, nibabel, SimpleITK; or an
        array: (n, 3) are points, and one of three axes is a volume.

        Parameters
        ----------
        thing
            What to add.
        preset, transfer
            As for :meth:`add_volume`, of a volume.
        color_by, colormap, clim, log_scale
            As for :meth:`add_points`, of points or a mesh. A file shows the column that suits it where ``color_by`` is None.
        up
            The axis of the data that points up, ``"y"``, ``"z"`` or ``"-y"``; what the data says, or y, where it is None.
        name
            As for :meth:`add_points`.
        **keys
            Further keys of an object, and of a data set or an array the further arguments of :meth:`add_points`, :meth:`add_mesh` or :meth:`add_volume`.
        """
        if isinstance(thing, (str, os.PathLike)):
            label = name or Path(_path("thing", thing)).name
            text("up", up, "'y', 'z' or '-y'")
            check_keys(Scene.add, label, keys)
            _check_look(transfer, preset)
            wish = {"preset": preset, "up": up, "color_by": color_by if isinstance(color_by, str) else None}
            if color_by is not None and not isinstance(color_by, str):
                keys = {"color_by": color_by} | keys
            if not is_named(colormap):
                raise InputError(f"colormap: expected the name of a map for a file, found {kind_of(colormap)}")
            if clim is not None and None in clim_of(clim):
                raise InputError(f"clim: expected two numbers for a file, which is not read yet, found {clim!r}")
            scale = _shown("", colormap, clim, flag("log_scale", log_scale))["color_by"]
            self._take(scene_of((os.path.abspath(thing),), _no_wish() | wish, _how()), name, keys, transfer, scale=scale)
            return
        stated = {"preset": preset, "transfer": transfer, "color_by": color_by, "colormap": colormap, "clim": clim, "log_scale": flag("log_scale", log_scale) or None}
        stated["transform"] = None if up is None else {"up": up}
        adopted.add(self, thing, name, {key: value for key, value in stated.items() if value is not None} | keys)

    def remove(self, name: str) -> None:
        """Removes an object with its data, so that another may have its name.

        Parameters
        ----------
        name
            Its name, one of :attr:`objects`.

        Raises
        ------
        InputError
            For a name that no object has; nothing is removed then.
        """
        self._check_open()
        objects = self._document.get("object", [])
        if not isinstance(name, str) or name not in self.objects:
            known = ", ".join(self.objects) or "none"
            question = meant(name, self.objects) if isinstance(name, str) else ""
            raise InputError(f"remove: expected the name of an object, one of {known}, found {name!r}{question}")
        left = [thing for thing in objects if thing["name"] != name]
        # A scene without objects states none, as a new one does.
        self._document = {key: value for key, value in self._document.items() if key != "object"} | ({"object": left} if left else {})
        # A field that the object showed goes with it; data that other objects show stays.
        text = json.dumps(left)
        self._data = {label: data for label, data in self._data.items() if json.dumps(_MEMORY + label) in text}
        self._remarks = [remark for remark in self._remarks if not remark.startswith(f"{name}: ")]
        self._beyond.pop(name, None)
        if self._ground is not None and self._ground.name == name:
            self._ground = None

    # Everything else.

    def set(self, key: str, value: Any) -> None:
        """Sets a key of docs/scene.md, such as ``scene.set("render.technique", "surfels")`` or ``scene.set("object.scan.opacity", 0.5)``; objects and lights
        are named, materials too. A name with dots may stand in quotes, ``scene.set('object."scan.v2".opacity', 0.5)``, and has to where another name is its
        beginning."""
        self._check_open()
        if not isinstance(key, str):
            raise InputError(f"key: expected a text, such as 'render.technique', found {kind_of(key)}")
        parts = path_in(self._document, key)
        if not all(parts) or value is None:
            raise InputError(f"{key!r}: expected a key and a value, such as 'render.technique' and 'surfels', found {value!r}")
        if parts[-1] == "color":
            value = color_of(value, key)
        if len(parts) == 3 and parts[0] in ("object", "light") and parts[2] == "name":
            raise InputError(f"{key}: expected another key, found the name, which stays what it is; `remove` takes an object away, to add it by another name")
        # What is refused changes nothing.
        changed = copy.deepcopy(self._document)
        place: Any = changed
        is_set = False
        for part, following in zip(parts, parts[1:] + [""]):
            if part in ("object", "light") and place is changed:
                place = place.setdefault(part, [])
            elif isinstance(place, list):
                place = _named(place, part, key)
            elif not isinstance(place, dict):
                raise InputError(f"{key}: expected a key below a table, found {place!r} above `{part}`")
            elif not following:
                place[part] = plain(value, key)
                is_set = True
            else:
                place = place.setdefault(part, {})
        if not is_set:
            raise InputError(f"{key}: expected a key of an object or a light, found its name alone")
        if parts[0] == "object":
            self._check_object(_named(changed["object"], parts[1], key))
        elif key == "render.layers":
            self._check_layers(plain(value, key))
        elif key == "render.technique":
            _organza.check(json.dumps({"version": 1, "camera": {"auto": True}, "render": {"technique": plain(value)}}), {})
        else:
            _check_shape(changed)
        self._document = changed

    @property
    def camera(self) -> Camera:
        """The camera: ``scene.camera(position=…, target=…)``, or ``scene.camera.orbit(azimuth=30, elevation=20)``."""
        return Camera(self)

    @property
    def light(self) -> Light:
        """The lights: ``scene.light(kind, …)`` adds one, and ``scene.light.sun(…)`` a sun by its angles."""
        return Light(self)

    def ground(
        self,
        *,
        size: float | None = None,
        height: float | None = None,
        color: Any = None,
        material: str | None = None,
        name: str | None = None,
        **keys: Any,
    ) -> None:
        """Puts a level ground below everything that the scene shows.

        The place is found when the picture is drawn, so that data which is added later stands on it too. A camera that sees everything is placed by what
        stands on the ground.

        Parameters
        ----------
        size
            Width and depth, in the unit of the scene; eight times the diagonal of what stands on it where it is None.
        height
            Its y; the lowest place of what stands on it where it is None. (A scene's y points up; ``transform={"up": "z"}`` of an object turns its data.)
        color
            Three linear numbers; a grey where neither ``color`` nor ``material`` is given.
        material
            The name of a material, see :meth:`material`.
        name
            How the object is called; "ground" where it is None.
        **keys
            Further keys of an object (docs/scene.md). It is lit in every pixel (``technique="sheets"``) and casts no shadow unless they say otherwise.

        Raises
        ------
        InputError
            For a second ground, a size that is not above 0, and numbers that are not finite.
        """
        self._check_open()
        if self._ground is not None:
            raise InputError(f"ground: expected one ground, found a second beside '{self._ground.name}'")
        for key, value in (("size", size), ("height", height)):
            if value is not None:
                number(key, value)
        if size is not None and size <= 0.0:
            raise InputError(f"size: expected a number above 0, found {size!r}")
        label = self._name(name, "ground")
        color = color_of(color)
        if color is None and material is None:
            color = _GROUND_COLOR
        stated = {"color": color, "material": material}
        looks = {key: value for key, value in stated.items() if value is not None}
        check_keys(Scene.ground, label, keys)
        thing = {"technique": "sheets", "casts_shadow": False} | looks | keys | {"name": label}
        self._check_object(plain(thing) | _ANYWHERE)
        self._document.setdefault("object", []).append(plain(thing))
        self._ground = _Ground(label, size, height)

    def material(self, name: str, **keys: Any) -> None:
        """States a material, which objects name by ``material="NAME"``; keys as in docs/scene.md."""
        self._check_open()
        if not isinstance(name, str):
            raise InputError(f"name: expected a text, found {name!r}")
        stated = plain(keys | ({"color": color_of(keys["color"])} if "color" in keys else {}))
        _check_shape({"material": {name: stated}})
        # The values of its keys, too.
        _organza.check(json.dumps({"version": 1, "camera": {"auto": True}, "material": {name: stated}}), {})
        self._document.setdefault("material", {})[name] = stated

    def to_toml(self) -> str:
        """The scene as the text of a scene file. Data from arrays is named ``memory:NAME`` in it, which a file cannot hold."""
        if self._text is not None:
            return self._text
        return _organza.toml_text(json.dumps(self._grounded(_how(), None, None)))

    @property
    def objects(self) -> list[str]:
        """Names of its objects."""
        return [thing["name"] for thing in self._document.get("object", [])]

    @property
    def notes(self) -> list[str]:
        """What a first scene decided that a user may want otherwise, what was made of arrays, which of them stand otherwise than the rest, and what its camera does not see,
        one sentence each."""
        return self._remarks + self._standing_remarks() + self._beyond_remarks()

    def __repr__(self) -> str:
        return f"<organza.Scene {self._file}>" if self._text else f"<organza.Scene of {', '.join(self.objects) or 'nothing'}>"

    def __getstate__(self) -> dict[str, Any]:
        data = {name: (data.kind, data.arrays()) for name, data in self._data.items()}
        return {"document": self._document, "text": self._text, "file": self._file, "data": data, "remarks": self._remarks, "written": self._written, "ground": self._ground, "beyond": self._beyond}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self._document = state["document"]
        self._text = state["text"]
        self._file = state["file"]
        self._remarks = state["remarks"]
        self._written = state["written"]
        self._ground = state["ground"]
        self._beyond = state["beyond"]
        self._data = {name: getattr(Data, kind)(**arrays) for name, (kind, arrays) in state["data"].items()}

    def _check_open(self) -> None:
        if self._text is not None:
            raise InputError(f"{self._file}: a scene that was loaded stays as its file has it; change the file")

    def _add(
        self,
        source: str,
        data: Data,
        name: str | None,
        keys: Mapping[str, Any],
        table: Mapping[str, Any] | None = None,
        field: Field | None = None,
    ) -> None:
        """Adds an object of data in memory; with a table its source is that, of a volume."""
        self._check_open()
        label = self._name(name, source)
        place = _MEMORY + label
        thing = {"name": label, source: place if table is None else {"volume": place} | plain(table)}
        self._append(thing, keys, field, {label: data})
        self._remarks += [f"{label}: {note}" for note in data.notes]

    def _add_file(
        self,
        source: str,
        path: str | os.PathLike[str],
        table: Mapping[str, Any] | None,
        name: str | None,
        keys: Mapping[str, Any],
        field: Field | None = None,
    ) -> None:
        """Adds an object of a file; with a table its source is that, of a volume."""
        self._check_open()
        place = os.path.abspath(path)
        label = self._name(name, Path(place).name.split(".")[0] or source)
        thing = {"name": label, source: place if table is None else {"volume": place} | plain(table)}
        self._append(thing, keys, field, {})

    def _append(self, thing: dict[str, Any], keys: Mapping[str, Any], field: Field | None, data: dict[str, Data]) -> None:
        """Adds an object that is right, with the field that it shows."""
        if field is not None:
            table = dict(field.table)
            if field.data is not None:
                name = _free(f"{thing['name']} field", {*self.objects, *self._data, *data})
                data = data | {name: field.data}
                table["volume"] = _MEMORY + name
            thing |= plain({"field": table} | field.keys)
        thing |= plain({key: value for key, value in _looks(thing, keys).items() if value is not None})
        self._check_object(thing, data)
        self._data |= data
        self._state_material(thing)
        self._document.setdefault("object", []).append(thing)

    def _check_layers(self, layers: Any) -> None:
        """Refuses layers that there are not. A technique that has a layer of its own may be stated later."""
        own = "std_error"
        listed = [layer for layer in layers if layer not in (own, "scatterN")] if isinstance(layers, list) else layers
        _organza.check(json.dumps({"version": 1, "camera": {"auto": True}, "render": {"layers": listed}}), {})

    def _check_materials(self) -> None:
        """Refuses objects that name a material which is not stated."""
        stated = self._document.get("material", {})
        for thing in self._document.get("object", []):
            listed = thing.get("materials")
            for name in [thing.get("material"), *(listed if isinstance(listed, list) else [])]:
                if isinstance(name, str) and name not in stated:
                    known = ", ".join(stated) or "none"
                    question = meant(name, stated)
                    raise InputError(
                        f"object '{thing['name']}', material: expected one that the scene states ({known}), found {name!r}{question or ';'} "
                        f"scene.material({name!r}, …) states it"
                    )

    def _check_object(self, thing: Mapping[str, Any], data: Mapping[str, Data] | None = None) -> None:
        """Refuses an object that no scene may have, whatever else it shows. Materials that it names may be stated later."""
        document: dict[str, Any] = {"version": 1, "camera": {"auto": True}, "object": [{**thing, **(_ANYWHERE if self._is_ground(thing) else {})}]}
        materials = dict(self._document.get("material", {}))
        listed = thing.get("materials")
        for name in [thing.get("material"), *(listed if isinstance(listed, list) else [])]:
            if isinstance(name, str):
                materials.setdefault(name, _MADE_MATERIALS.get(name, {}))
        if "footprints" in self._document:
            document["footprints"] = self._document["footprints"]
        elif isinstance(thing.get("footprint"), int):
            document["object"] = [{key: value for key, value in document["object"][0].items() if key != "footprint"}]
        text = json.dumps(document | {"material": materials})
        named = {name: part for name, part in {**self._data, **(data or {})}.items() if json.dumps(_MEMORY + name) in text}
        _organza.check(text, named)

    def _state_material(self, thing: Mapping[str, Any]) -> None:
        """States the material of an object that is made here, once the object is right."""
        name = thing.get("material")
        if name in _MADE_MATERIALS:
            self._document.setdefault("material", {}).setdefault(name, dict(_MADE_MATERIALS[name]))

    def _name(self, name: str | None, default: str) -> str:
        """The name of a new object: one that no other has, or the default with a number."""
        label = _label(name)
        if label is None:
            return self._free_name(default)
        if label in self.objects or label in self._data:
            raise InputError(f"name: expected one that no object of the scene has, found {label!r} a second time; the scene has {', '.join(self.objects)}")
        return label

    def _note_beyond(self, label: str, places: Any, keys: Mapping[str, Any]) -> None:
        """Keeps the share of an object that the camera of a first scene does not see."""
        if self._written is not None and "position" in self._document.get("camera", {}):
            share = beyond(self._document["camera"], places, plain(keys.get("transform") or {}))
            if share > 0.0:
                self._beyond[label] = share

    def _beyond_remarks(self) -> list[str]:
        """What is said of objects that were added to a first scene, as long as its camera stays where it is."""
        if self._written is None or self._document.get("camera") != self._written.document.get("camera"):
            return []
        there = [name for name in self._beyond if name in self.objects]
        advice = "the camera stays where the first scene has it: scene.camera.orbit() sees everything"
        return [f"{name}: {_percent(self._beyond[name])} of it lies outside the view, as {advice}" for name in there]

    def _standing_remarks(self) -> list[str]:
        """What is said of arrays beside data whose z, or whose -y, points up: arrays that state no axis have y up."""
        things = [thing for thing in self._document.get("object", []) if not self._is_ground(thing)]
        ups = {thing["name"]: (thing.get("transform") or {}).get("up") for thing in things}
        if not any(up is None and name in self._data for name, up in ups.items()):
            return []
        ups |= {thing["name"]: _up_of_file(thing) for thing in things if ups[thing["name"]] is None and thing["name"] not in self._data}
        turned = {name: up for name, up in ups.items() if up not in (None, "y")}
        if not turned:
            return []
        other, axis = next(iter(turned.items()))
        arrays = [name for name, up in ups.items() if up is None and name in self._data]
        return [f"{name}: its y points up, where {axis} does in {other}; transform={{\"up\": \"{axis}\"}} turns it alike" for name in arrays]

    def _is_ground(self, thing: Mapping[str, Any]) -> bool:
        return self._ground is not None and thing["name"] == self._ground.name

    def _free_name(self, name: str) -> str:
        return _free(name, {*self.objects, *self._data})

    def _first_keys(self, data: Data, name: str, preset: str | None) -> tuple[str, dict[str, Any]]:
        """What a first scene says of a volume, and whether that is one or the surfaces of labels; its material becomes one of this scene."""
        text, remarks, _ = _organza.first_scene([(name, data, "y")], _no_wish() | {"preset": preset}, _how())
        first = json.loads(text)
        thing = first["object"][0]
        source = "mesh" if "mesh" in thing else "volume"
        if source == "mesh":
            self._remarks += [remark.removeprefix(_MEMORY) for remark in remarks]
        keys = {key: value for key, value in thing.items() if key not in ("name", source)}
        self._take_material(first, keys, name)
        return source, keys

    def _take(
        self,
        first: Scene,
        name: str | None,
        keys: Mapping[str, Any],
        transfer: Transfer | None = None,
        expected: str | None = None,
        scale: Mapping[str, Any] | None = None,
    ) -> None:
        """Takes the object of a first scene of one file; ``expected`` is the source that it is to have, ``scale`` the map of its column."""
        self._check_open()
        stated = {key: value for key, value in (scale or {}).items() if key != "column"}
        for thing in first._document.get("object", []):
            thing = dict(thing)
            source = next(source for source in _SOURCES if source in thing)
            file = thing[source]
            is_volume = source == "volume" or (source == "mesh" and thing.get("color_by", {}).get("column") == "label") or "labels" in thing
            if expected == "volume" and not is_volume:
                raise InputError(f"values: expected a volume, found {source}: {file}; scene.add({Path(file).name!r}) adds it")
            if transfer is not None:
                if source != "volume":
                    raise InputError(f"transfer: expected a volume of amounts, found {source}: {file}; leave it out")
                facts = _organza.info_of_file(file, _how())
                thing |= transfer.keys(_diagonal(facts), transfer.ends(functools.partial(_ends_of_file, facts)))
            if stated:
                if "color_by" not in thing | dict(keys):
                    raise InputError(f"colormap, clim, log_scale: expected a column to colour by, found none in {source}: {file}; give `color_by`")
                thing["color_by"] = thing.get("color_by", {}) | stated
            thing = _without_colors(thing, keys)
            self._take_material(first._document, thing, thing["name"])
            thing["name"] = self._name(name, thing["name"])
            thing |= plain({key: value for key, value in _looks(thing, keys).items() if value is not None})
            self._check_object(thing)
            self._state_material(thing)
            self._document.setdefault("object", []).append(thing)
        self._remarks += first._remarks

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
        turntable: int | None = None,
    ) -> dict[str, Any]:
        """The scene as the extension takes it, with what it does not state; ``turntable`` is the pictures of a turn around it."""
        size = sides_of(size)
        transparent = flag("transparent", transparent)
        if effects is not None and not isinstance(effects, Mapping):
            raise InputError(f"effects: expected names with 'on' or 'off', such as {{'shadow.sun': 'off'}}, found {effects!r}")
        switches = [f"{name}={_switch(str(name), state)}" for name, state in (effects or {}).items()]
        given = self._given_text(self._text, size, turntable) | {"effects": switches, "transparent": transparent}
        if self._text is not None:
            return given
        if self._written is not None and self._written.document == self._document:
            # A size that it states already is no change of it.
            is_stated = size is not None and list(size) == self._document.get("camera", {}).get("size")
            return given | {"text": self._written.text, "file": self._written.file, "size": None if is_stated else size}
        self._check_materials()
        document = self._grounded(how, size, turntable)
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

    def _given_text(self, text: str | None, size: tuple[int, int] | None, turntable: int | None) -> dict[str, Any]:
        """A text with the scene's data as the extension takes it."""
        return {
            "text": text,
            "file": self._file,
            "data": self._data,
            "effects": [],
            "changes": [],
            "size": size,
            "transparent": False,
            "frame": None,
            "turntable": turntable,
        }

    def _grounded(self, how: dict[str, Any], size: tuple[int, int] | None, turntable: int | None) -> dict[str, Any]:
        """The document with its ground in its place, and a camera that sees what stands on it."""
        ground = self._ground
        document = self._document
        if ground is None:
            return copy.copy(document)
        standing = [thing for thing in document["object"] if thing["name"] != ground.name]
        if not standing:
            raise InputError("ground: expected data that stands on it, found none; add some")
        stated = dict(document.get("camera", {}))
        camera = {key: value for key, value in stated.items() if key not in ("position", "target", "up", "orthographic")}
        camera = {"size": list(_DEFAULT_SIZE)} | camera | {"auto": True}
        if "position" in stated:
            # Level with the picture, as an automatic camera has it.
            towards = np.subtract(stated["position"], stated.get("target", (0.0, 0.0, 0.0)))
            camera["azimuth"] = math.degrees(math.atan2(towards[0], towards[2]))
        above = document | {"object": standing, "camera": camera}
        given = self._given_text(json.dumps(above), size, turntable)
        found = json.loads(_organza.ground_of(given, how))
        rectangle = found["object"][0]["rectangle"]
        if ground.height is not None:
            rectangle["center"][1] = ground.height
        if ground.size is not None:
            factor = 0.5 * ground.size / float(np.linalg.norm(rectangle["u"]))
            rectangle |= {side: [factor * part for part in rectangle[side]] for side in ("u", "v")}
            rectangle["spacing"] = ground.size / _GROUND_STEPS
        things = [thing | {"rectangle": rectangle} if thing["name"] == ground.name else thing for thing in document["object"]]
        if "position" not in stated:
            kept = {key: value for key, value in stated.items() if key not in ("auto", "azimuth", "elevation", "fit")}
            stated = kept | {key: found["camera"][key] for key in ("position", "target", "up") if key in found["camera"]}
        return document | {"object": things, "camera": stated}


def _path(name: str, thing: str | os.PathLike[str]) -> str:
    """The path of a file; an empty one would be the working directory."""
    path = os.fspath(thing)
    if not path:
        raise InputError(f"{name}: expected the path of a file, found an empty text")
    return path


def scene_of(what: tuple[Any, ...], wished: Mapping[str, Any], how: dict[str, Any]) -> Scene:
    """A scene, or the first scene of files and data."""
    if not what:
        raise InputError("what: expected a scene, files or data, found nothing")
    wishes = [key for key, value in wished.items() if value is not None and value is not False and key not in ("size", "turntable")]
    if len(what) == 1 and (isinstance(what[0], Scene) or _is_scene(what[0])):
        if wishes:
            raise InputError(f"{', '.join(wishes)}: expected data, found a scene, which states that itself: by scene.camera.orbit, scene.ground and its objects")
        return what[0] if isinstance(what[0], Scene) else Scene.load(what[0])
    shown: list[Any] = []
    data_by_name: dict[str, Data] = {}
    adopted_remarks: list[str] = []
    for thing in what:
        if isinstance(thing, Scene) or _is_scene(thing):
            raise InputError(f"what: expected one scene, or files and data, found a scene among {len(what)}")
        if isinstance(thing, (str, os.PathLike)):
            shown.append(os.path.abspath(_path("what", thing)))
            continue
        found = adopted.data_of(thing)
        name = _free(found.name, data_by_name)
        data_by_name[name] = found.data
        shown.append((name, found.data, found.up))
        adopted_remarks += found.remarks
        if len(what) == 1 and wished["color_by"] is None:
            wished = dict(wished) | {"color_by": found.color_by}
    text, remarks, written = _organza.first_scene(shown, dict(wished), how)
    scene = Scene()
    scene._document = json.loads(text)
    scene._data = data_by_name
    scene._remarks = adopted_remarks + remarks
    # A scene may be drawn in another working folder than it was made in.
    for first in scene._document.get("object", []):
        for source in _SOURCES:
            if source in first and not first[source].startswith(_MEMORY):
                first[source] = os.path.abspath(first[source])
    scene._written = _Written(copy.deepcopy(scene._document), written, os.path.abspath(_FIRST))
    return scene


def _check_shape(document: Mapping[str, Any]) -> None:
    """Refuses keys that scenes do not have, and values of other types."""
    camera = document.get("camera") or {"auto": True}
    seen = camera if not isinstance(camera, dict) or "position" in camera else {"auto": True} | camera
    _organza.check_keys(json.dumps(dict(document) | {"version": 1, "camera": seen, "object": []}))


def _check_array(name: str, thing: Any) -> None:
    """Refuses an empty array, and a path or a data set of a library in its place, with the call that takes it."""
    if isinstance(thing, (str, os.PathLike)):
        raise InputError(f"{name}: expected an array, found a path; scene.add({os.fspath(thing)!r}) adds a file")
    adopted.check_array(name, thing)
    if isinstance(thing, Mapping):
        found = f"a mapping of {', '.join(map(str, thing)) or 'nothing'}"
        raise InputError(f"{name}: expected an array, found {found}; `np.column_stack([x, y, z])` makes rows of columns")
    shape = np.shape(array_of(thing, name))
    if shape[:1] == (0,):
        raise InputError(f"{name}: expected one row or more, found none")
    instead = {2: f"`np.column_stack([{name}, np.zeros(len({name}))])` lies in a plane", 3: f"`{name}.T` has rows of three"}
    side = 3 if shape[:1] == (3,) else shape[-1] if shape else 0
    if name != "faces" and len(shape) == 2 and shape[1] != 3 and side in instead:
        raise InputError(f"{name}: expected the shape (n, 3), found {shape}; {instead[side]}")


def _check_finite(name: str, thing: Any) -> None:
    """Refuses places or numbers that are not finite, with the first such row."""
    array = array_of(thing, name)
    if np.ndim(array) not in (1, 2) or not np.issubdtype(array.dtype, np.floating):
        return
    # A sum is finite where all are, but for overflow.
    with np.errstate(over="ignore", invalid="ignore"):
        if np.isfinite(array.sum()):
            return
    are_finite = np.isfinite(array)
    wrong = ~(are_finite if array.ndim == 1 else are_finite.all(axis=1))
    if wrong.any():
        row = int(np.argmax(wrong))
        what = "numbers" if array.ndim == 1 else "coordinates"
        masked = ", which is masked" if np.ma.is_masked(thing) else ""
        raise InputError(f"{name}: expected finite {what}, found {array[row].tolist()} in row {row}{masked}; leave such rows out")


def _check_faces(faces: Any) -> None:
    """Refuses counts and indices as VTK has them, in one row or in one for each face."""
    flat = array_of(faces, "faces")
    # Five quads that all begin with vertex 3 are hardly meant.
    if np.ndim(flat) == 2 and flat.shape[1] == 4 and len(flat) >= 5 and (flat[:, 0] == 3).all():
        raise InputError("faces: expected the corners of each face, found 3 before those of each, as VTK counts them; give `faces[:, 1:]`")
    if np.ndim(flat) != 1 or not len(flat):
        return
    sides = next((sides for sides in (3, 4) if len(flat) % (sides + 1) == 0 and (flat[:: sides + 1] == sides).all()), None)
    if sides is not None:
        raise InputError(f"faces: expected the shape (m, {sides}), found counts and indices of VTK in one row; give `faces.reshape(-1, {sides + 1})[:, 1:]`")


def _check_labels(numbers: np.ndarray) -> None:
    """Refuses numbers that name no regions."""
    is_float = numbers.dtype.kind == "f"
    if numbers.size and np.nanmax(numbers) > _MOST_LABELS:
        raise InputError(f"values: expected labels of at most {_MOST_LABELS}, found {int(np.nanmax(numbers))}; `np.unique(values, return_inverse=True)` counts them anew")
    present = numbers[np.isfinite(numbers)] if is_float else numbers
    odd = present[(present < -1) | (present != np.round(present))] if is_float else present[present < -1]
    if odd.size:
        raise InputError(f"values: expected whole numbers from 0 that name regions, or -1 for none, found {odd[0]:g}")
    if not (present > 0).any():
        raise InputError("values: expected a label other than 0 and -1, which are nothing, found none")


def _axes(places: Any) -> dict[str, Any]:
    """The columns that rows of coordinates have by themselves."""
    is_of_places = np.ndim(places) == 2 and places.shape[1] == 3
    return {axis: places[:, at] for at, axis in enumerate("xyz")} if is_of_places else {}


def _check_look(transfer: Any, preset: Any) -> None:
    """Refuses what is no look of a volume, and two of them."""
    if transfer is not None and not isinstance(transfer, Transfer):
        raise InputError(f"transfer: expected what organza.transfer makes, found {type(transfer).__name__}; `preset` takes a name")
    if transfer is not None and preset is not None:
        raise InputError("transfer, preset: expected one of them, found both")
    if preset is not None and not isinstance(preset, str):
        raise InputError(f"preset: expected the name of a look, found {type(preset).__name__}")


def _colors_by(
    column: str | None,
    colormap: Any,
    clim: Any,
    log_scale: bool,
    field: Any,
    transfer: Any,
    numbers: Mapping[str, Any],
) -> tuple[Field | None, dict[str, Any]]:
    """The field that points or a mesh show, and else the keys of the column that they are coloured by; ``numbers`` are those of known columns."""
    log_scale = flag("log_scale", log_scale)
    if field is not None:
        if column is not None:
            raise InputError("field, color_by: expected one of them, found both")
        return field_of(field, {}, colormap, clim, transfer, log_scale), {}
    if transfer is not None and column is None:
        raise InputError("transfer: expected a column or a field to colour by, found none; give `values`, `color_by` or `field`")
    if transfer is not None and (colormap is not None or clim is not None):
        raise InputError("transfer, colormap, clim: expected the colours of the column once, found them twice")
    if transfer is None and not is_named(colormap):
        if column is None or log_scale:
            found = "none; give `values` or `color_by`" if column is None else "one with `log_scale`, which takes a map by its name"
            raise InputError(f"colormap: expected a column to colour by, found {found}")
        transfer = make_transfer(colormap, clim)
        colormap = clim = None

    def ends() -> tuple[float, float]:
        if not isinstance(column, str) or column not in numbers:
            raise InputError(f"clim: expected two numbers for the column {column!r}, which is none of the arrays, found {clim}")
        shown = np.asarray(numbers[column], dtype=np.float64)
        return percentiles(shown[shown > 0.0] if log_scale else shown, f"the column '{column}'", "a number to show")

    stated = clim_of(clim)
    # Without any end, drawing finds both.
    clim = None if stated == (None, None) else make_transfer(clim=stated).ends(ends)
    keys = _shown(column, colormap, clim, log_scale)
    if isinstance(transfer, Transfer):
        transfer = transfer.colors_over(transfer.ends(ends))
    return None, keys | ({} if transfer is None else {"transfer": transfer})


def _up_of_file(thing: Mapping[str, Any]) -> str | None:
    """The axis that points up in the file of an object, by its header; None where it has no file, or one that cannot be read now."""
    tables = [table["volume"] for table in thing.values() if isinstance(table, dict) and "volume" in table]
    named = [(source, thing[source]) for source in ("mesh", "points") if source in thing]
    # A volume has a source here that needs no look.
    found = named or [("isosurface", {"volume": file, "level": 0.0}) for file in [thing.get("volume"), *tables] if file is not None]
    if not found:
        return None
    source, file = found[0]
    document = {"version": 1, "camera": {"auto": True}, "object": [{"name": "file", source: file}]}
    given = Scene()._given_text(json.dumps(document), None, None)
    try:
        return str(json.loads(_organza.info_of_scene(given, _how()))["objects"][0]["up"])
    except (InputError, OSError):
        # Drawing says what is wrong with it.
        return None


def _labels_of(labels: Any) -> Any:
    """The labels of an object, whose colours are linear: the path of a table, or numbers with names or tables."""
    expected = 'labels: expected whole numbers with their names, such as {1: "bone"}, or the path of a table'
    if isinstance(labels, (str, os.PathLike)):
        return labels
    if not isinstance(labels, Mapping):
        raise InputError(f"{expected}, found {kind_of(labels)}")
    stated: dict[str, Any] = {}
    for key, look in labels.items():
        if str(key) != "table" and not re.fullmatch("[0-9]+", str(key)):
            raise InputError(f"{expected}, found {key!r} in the place of a number")
        has_color = isinstance(look, Mapping) and look.get("color") is not None
        stated[str(key)] = {**look, "color": color_of(look["color"], f"labels, {key}, color")} if has_color else look
    return stated


def _without_colors(thing: dict[str, Any], keys: Mapping[str, Any]) -> dict[str, Any]:
    """The keys that a first scene has for labels, without the colours in whose place a user states labels."""
    is_replaced = keys.get("labels") is not None and thing.get("color_by", {}).get("column") == "label"
    return {key: value for key, value in thing.items() if not (is_replaced and key == "color_by")}


def _missing_labels(labels: Any, numbers: np.ndarray) -> list[str]:
    """The labels of a table that no voxel has."""
    if not isinstance(labels, Mapping):
        return []
    present = {str(int(label)) for label in np.unique(np.nan_to_num(numbers))}
    return [str(label) for label in labels if str(label) not in present]


def _looks(thing: Mapping[str, Any], keys: Mapping[str, Any]) -> dict[str, Any]:
    """Keys of an object with a linear colour, and with a material in the place of ``unlit`` where it is a surface."""
    stated = dict(keys)
    if stated.get("color") is not None:
        stated["color"] = color_of(stated["color"])
    if stated.get("labels") is not None:
        stated["labels"] = _labels_of(stated["labels"])
    if any(source in thing for source in _SURFACES) and isinstance(stated.get("unlit"), bool):
        if stated.pop("unlit"):
            if stated.get("material") is not None:
                raise InputError(f"object '{thing['name']}', unlit, material: expected one of them, found both; a material has shading=\"unlit\"")
            stated["material"] = _UNLIT_SURFACE
    return stated


def _diagonal(facts: str) -> float:
    """The diagonal of the volume of a file, in its unit, from what is known of the file."""
    return float(np.linalg.norm(json.loads(facts)["size"])) or 1.0


def _ends_of_file(facts: str) -> tuple[float, float]:
    """The 1st and the 99th percentile of the volume of a file; where both are one, the least and greatest; growing in any case."""
    known = json.loads(facts)
    shares = [value for _, value in known["quantiles"]]
    low, high = (shares[0], shares[-1]) if shares and shares[0] < shares[-1] else known["range"]
    return (low, high) if low < high else (low, low + max(abs(low), 1.0))


def _switch(name: str, state: Any) -> str:
    """A state of an effect as the command writes it."""
    if isinstance(state, bool):
        return "on" if state else "off"
    if state not in ("on", "off", "auto"):
        raise InputError(f"effects, '{name}': expected 'on', 'off' or 'auto', found {state!r}")
    return str(state)


def _percent(share: float) -> str:
    """A share in words, never all or nothing by rounding."""
    percent = 100.0 * share
    return "less than 1 %" if percent < 1.0 else f"{math.floor(percent)} %"


def _kind(thing: Any) -> str:
    """What a thing is, for messages."""
    return repr(thing) if isinstance(thing, str) else type(thing).__name__


def _label(name: Any) -> str | None:
    """The name of an object, where it has one."""
    return text("name", name, "a text")


def _shown(column: str | None, colormap: str | None, clim: Any, log_scale: bool) -> dict[str, Any]:
    """The keys of an object whose colours stand for a column."""
    if column is not None and not isinstance(column, (str, Mapping)):
        raise InputError(f"color_by: expected the name of a column, found {_kind(column)}; `values` takes its numbers, and `field` a volume")
    if isinstance(column, Mapping):
        if colormap is not None or clim is not None or log_scale:
            raise InputError("colormap, clim, log_scale: expected the keys `map`, `range` and `scale` in the table of `color_by`, found both")
        return {"color_by": column}
    if column is None:
        if colormap is not None or clim is not None or log_scale:
            raise InputError("colormap, clim, log_scale: expected a column to colour by, found none; give `values` or `color_by`")
        return {}
    shown: dict[str, Any] = {"column": column}
    if colormap is not None:
        shown["map"] = colormap
    if clim is not None:
        shown["range"] = plain(clim, "clim")
    if log_scale:
        shown["scale"] = "log"
    return {"color_by": shown}


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
