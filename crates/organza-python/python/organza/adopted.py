"""Data sets of other libraries, told apart by what they have; nothing of these libraries is imported unless a data set of theirs is there."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from organza._organza import Data, InputError
from organza.arrays import array_of
from organza.transfers import transfer
from organza.values import kind_of

if TYPE_CHECKING:
    from organza.scene import Scene

# What trimesh takes as the diffuse colour of a material that states none.
_NO_DIFFUSE = [102, 102, 102, 255]
# Kinds of data sets in messages.
_IN_WORDS = {"mesh": "a mesh", "points": "a set of points"}
# Left and back to right and front.
_HALF_TURN = np.array([-1.0, -1.0, 1.0])


@dataclass(frozen=True)
class Adopted:
    """A data set for a first scene."""

    name: str
    data: Data
    up: str | None
    """The axis that points up in it, where that is known."""
    color_by: str | None
    """The column of a mesh that its library shows."""
    remarks: list[str]
    """What of it is not used, and what was made of it, one sentence each."""


def add(scene: Scene, thing: Any, name: str | None, keys: Mapping[str, Any]) -> None:
    """Adds a data set to a scene."""
    kind, own, arguments = _arguments(thing)
    unused = list(arguments.pop("unused", []))
    if "uv" in arguments and "texture" not in arguments and "texture" not in keys:
        del arguments["uv"]
        unused.append("texture coordinates, as there is no `texture`")
    if any(keys.get(look) is not None for look in ("color", "colors", "texture", "field")):
        # The look that is asked for takes the place of the column that the library shows.
        arguments.pop("color_by", None)
    before = len(scene.objects)
    # The library's name may be taken, by a data set of the same library.
    getattr(scene, f"add_{kind}")(name=scene._free_name(own) if name is None else name, **(arguments | dict(keys)))
    if unused:
        scene._remarks.append(f"{scene.objects[before]}: not used: {', '.join(unused)}")


def volume_of(thing: Any, name: str) -> dict[str, Any]:
    """The arguments of ``Scene.add_volume`` for an array or the volume of another library; ``name`` is the argument that it stands for."""
    for look in (_vtk, _nibabel, _simpleitk, _xarray, _trimesh, _open3d):
        found = look(thing)
        if found is None:
            continue
        kind, _, arguments = found
        if kind != "volume":
            raise InputError(f"{name}: expected a volume, found {kind_of(thing)}, which is {_IN_WORDS[kind]}; scene.add(x) takes it")
        arguments.pop("unused", None)
        return arguments
    return {"values": thing}


def check_array(name: str, thing: Any) -> None:
    """Refuses a data set of another library in the place of an array, with the call that takes it."""
    if _is_data_set(thing):
        raise InputError(f"{name}: expected an array, found {kind_of(thing)}; scene.add(x) takes it")


def _is_data_set(thing: Any) -> bool:
    """Whether a thing is a data set of a library, and no array of it."""
    if isinstance(thing, (np.ndarray, list, tuple)):
        return False
    module = type(thing).__module__.partition(".")[0]
    is_of_vtk = hasattr(thing, "GetClassName") and hasattr(thing, "GetNumberOfPoints")
    is_of_trimesh = module == "trimesh" and (hasattr(thing, "vertices") or hasattr(thing, "geometry"))
    is_of_open3d = module == "open3d" and (hasattr(thing, "points") or hasattr(thing, "triangles"))
    is_image = (hasattr(thing, "affine") and hasattr(thing, "dataobj")) or (module == "SimpleITK" and hasattr(thing, "GetSpacing"))
    return is_of_vtk or is_of_trimesh or is_of_open3d or is_image or (module == "xarray" and hasattr(thing, "data_vars"))


def data_of(thing: Any) -> Adopted:
    """A data set for a first scene."""
    from organza.scene import Scene

    kind, name, arguments = _arguments(thing)
    up = arguments.pop("transform", {}).get("up")
    # What a first scene decides of points; of a mesh it shows a column if that is asked for.
    color_by = arguments.pop("color_by", None)
    if kind == "volume":
        # It is not drawn by this, and its values tell no ends.
        arguments["transfer"] = transfer(clim=(0.0, 1.0))
    scene = Scene()
    unused = list(arguments.pop("unused", []))
    if "uv" in arguments and "texture" not in arguments:
        del arguments["uv"]
        unused.append("texture coordinates, as there is no `texture`")
    getattr(scene, f"add_{kind}")(name=name, **arguments)
    remarks = scene._remarks + ([f"{name}: not used: {', '.join(unused)}"] if unused else [])
    return Adopted(name, scene._data[name], up, color_by if kind == "mesh" else None, remarks)


def _arguments(thing: Any) -> tuple[str, str, dict[str, Any]]:
    """What a data set is, a name for it, and the arguments of ``Scene.add_…``."""
    for look in (_vtk, _trimesh, _open3d, _nibabel, _simpleitk, _xarray, _array):
        found = look(thing)
        if found is not None:
            return found
    kind = f"{type(thing).__module__}.{type(thing).__qualname__}"
    instead = "; Scene.add_points takes positions, and the others by `columns`" if isinstance(thing, Mapping) else ""
    raise InputError(
        f"expected a file, a scene, an array, or a data set of PyVista, VTK, trimesh, Open3D, xarray, nibabel or SimpleITK, found {kind}{instead}"
    )


def _vtk(thing: Any) -> tuple[str, str, dict[str, Any]] | None:
    """PyVista's data sets, and VTK's, by way of PyVista."""
    if not hasattr(thing, "GetClassName") or not hasattr(thing, "GetNumberOfPoints"):
        return None
    if not hasattr(thing, "point_data"):
        try:
            import pyvista
        except ImportError:
            raise InputError("a data set of VTK: expected the package pyvista, which reads its arrays, found none") from None
        thing = pyvista.wrap(thing)
    if thing.IsA("vtkImageData"):
        scalars = thing.active_scalars
        if scalars is None or scalars.ndim != 1:
            raise InputError("the image: expected an active array of one number a point, found none; set `active_scalars_name`")
        width, height, depth = thing.dimensions
        if scalars.size != width * height * depth:
            thing = thing.cell_data_to_point_data()
            scalars = thing.active_scalars
        direction = getattr(thing, "direction_matrix", None)
        names = [*map(str, thing.point_data.keys()), *map(str, thing.cell_data.keys())]
        return (
            "volume",
            thing.active_scalars_name or "volume",
            {
                "values": np.asarray(scalars).reshape(depth, height, width),
                "spacing": thing.spacing,
                "origin": thing.origin,
                "direction": np.eye(3) if direction is None else np.asarray(direction),
                "unused": [name for name in names if name != thing.active_scalars_name],
            },
        )
    if not thing.IsA("vtkPolyData"):
        if not hasattr(thing, "extract_surface"):
            raise InputError(f"expected points, a surface or an image of VTK, found {thing.GetClassName()}")
        thing = _vtk_surface(thing)
    if thing.n_lines:
        said = "lines are not drawn; `tube(radius=…)` makes surfaces of them"
        if thing.n_lines == thing.n_cells:
            raise InputError(f"expected points, faces or voxels, found lines alone: {said}")
        warnings.warn(f"{thing.n_lines} {said}", stacklevel=5)
    is_surface = thing.n_cells > thing.n_verts + thing.n_lines
    if is_surface and thing.n_verts == 0:
        whole = thing.triangulate()
        faces = np.asarray(whole.faces).reshape(-1, 4)[:, 1:]
        mesh = {"vertices": np.asarray(whole.points), "faces": faces} | _vtk_arrays(whole, has_faces=True)
        places = whole.active_texture_coordinates
        return "mesh", "mesh", mesh if places is None else mesh | {"uv": np.asarray(places)[:, :2]}
    return "points", "points", {"positions": np.asarray(thing.points)} | _vtk_arrays(thing, has_faces=False)


def _vtk_surface(thing: Any) -> Any:
    """The surface of cells, by the algorithm that PyVista has always had, which older versions take no name of."""
    try:
        return thing.extract_surface(algorithm="dataset_surface")
    except TypeError:
        return thing.extract_surface()


def _vtk_arrays(thing: Any, has_faces: bool) -> dict[str, Any]:
    """Colours and columns of points, or of a mesh with its faces; the arrays that are neither are named."""
    colors = _vtk_colors(thing)
    active = thing.active_scalars_name
    columns = {}
    unused = []
    places = thing.active_texture_coordinates
    for part, data in [("point", thing.point_data), ("cell", thing.cell_data)]:
        for key, array in data.items():
            name = str(key)
            is_shown = colors is not None and name == active
            is_uv = places is not None and part == "point" and array is data.active_texture_coordinates
            is_column = np.ndim(array) == 1 and np.issubdtype(array.dtype, np.number) and (part == "point" or has_faces)
            if is_column and name not in columns:
                columns[name] = np.asarray(array)
            elif not (is_shown or is_uv):
                unused.append(name)
    arguments: dict[str, Any] = {"colors": colors, "columns": columns, "unused": unused}
    if colors is None and active in columns:
        arguments["color_by"] = active
    return arguments


def _vtk_colors(thing: Any) -> np.ndarray | None:
    """The active array, where it is colours in bytes."""
    scalars = thing.active_scalars
    is_colors = scalars is not None and scalars.ndim == 2 and scalars.shape[1] in (3, 4) and scalars.dtype == np.uint8
    return np.asarray(scalars)[:, :3] if is_colors and len(scalars) == thing.n_points else None


def _trimesh(thing: Any) -> tuple[str, str, dict[str, Any]] | None:
    """A mesh or points of trimesh."""
    module = type(thing).__module__
    if not module.startswith("trimesh"):
        return None
    if hasattr(thing, "geometry") and hasattr(thing, "to_geometry"):
        thing = thing.to_geometry()
    if hasattr(thing, "faces"):
        mesh = {"vertices": np.asarray(thing.vertices), "faces": np.asarray(thing.faces)}
        visual = getattr(thing, "visual", None)
        if visual is None or not visual.defined:
            return "mesh", "mesh", mesh
        textured = _trimesh_texture(visual, len(mesh["vertices"])) if visual.kind == "texture" else None
        if textured is not None:
            return "mesh", "mesh", mesh | textured
        seen = visual.to_color() if visual.kind == "texture" else visual
        return "mesh", "mesh", mesh | {"colors": np.asarray(seen.vertex_colors)[:, :3]}
    if hasattr(thing, "entities"):
        raise InputError(f"expected a mesh or points, found {kind_of(thing)}: lines are not drawn; its `vertices` are points")
    if hasattr(thing, "vertices"):
        colors = np.asarray(getattr(thing, "colors", np.empty(0)))
        known = colors[:, :3] if colors.ndim == 2 and len(colors) == len(thing.vertices) else None
        return "points", "points", {"positions": np.asarray(thing.vertices), "colors": known}
    return None


def _trimesh_texture(visual: Any, count: int) -> dict[str, Any] | None:
    """The texture of a material of trimesh with the factor of its colour, as its file has them; None without an image."""
    material = visual.material
    is_pbr = hasattr(material, "baseColorTexture")
    image = getattr(material, "baseColorTexture" if is_pbr else "image", None)
    if image is None or visual.uv is None:
        return None
    factor = getattr(material, "baseColorFactor" if is_pbr else "diffuse", None)
    # Factors are linear, in bytes. The grey of a material that states none darkens no image.
    is_stated = factor is not None and (is_pbr or list(factor) != _NO_DIFFUSE)
    tint = np.asarray(factor, dtype=float) / 255.0 if is_stated else np.ones(4)
    is_opaque = is_pbr and material.alphaMode not in ("BLEND", "MASK")
    has_alpha = not is_opaque and ("A" in image.mode or "transparency" in image.info)
    textured: dict[str, Any] = {"uv": np.asarray(visual.uv), "texture": image.convert("RGBA" if has_alpha else "RGB")}
    if not np.array_equal(tint[:3], np.ones(3)):
        textured["colors"] = np.tile(tint[:3], (count, 1))
    if not is_opaque and tint[3] != 1.0:
        textured["opacities"] = np.full(count, tint[3])
    return textured


def _open3d(thing: Any) -> tuple[str, str, dict[str, Any]] | None:
    """A mesh or points of Open3D's legacy types, whose colours are of a display."""
    if not type(thing).__module__.startswith("open3d"):
        return None

    def part(name: str) -> np.ndarray | None:
        array = np.asarray(getattr(thing, name, ()))
        return array if array.size else None

    def linear(colors: np.ndarray | None) -> np.ndarray | None:
        return None if colors is None else np.round(np.clip(colors, 0.0, 1.0) * 255.0).astype(np.uint8)

    if hasattr(thing, "triangles"):
        colors = linear(part("vertex_colors"))
        mesh = {"vertices": part("vertices"), "faces": part("triangles"), "colors": colors}
        return "mesh", "mesh", mesh | {"unused": [name for name in ("textures", "triangle_uvs") if len(getattr(thing, name, ()))]}
    if hasattr(thing, "points"):
        arguments = {"positions": part("points"), "normals": part("normals"), "colors": linear(part("colors"))}
        return "points", "points", arguments
    return None


def _nibabel(thing: Any) -> tuple[str, str, dict[str, Any]] | None:
    """An image of nibabel, in its own world: x to the right of the patient, y to the front, z up."""
    if not hasattr(thing, "affine") or not hasattr(thing, "dataobj"):
        return None
    values = np.asanyarray(thing.dataobj)
    if values.ndim == 4 and values.shape[3] == 1:
        values = values[..., 0]
    if values.ndim != 3:
        raise InputError(f"the image: expected three axes, found the shape {values.shape}; take one of a series")
    affine = np.asarray(thing.affine, dtype=float)
    steps = np.linalg.norm(affine[:3, :3], axis=0)
    arguments = {
        "values": values.transpose(),
        "spacing": steps,
        "origin": affine[:3, 3],
        "direction": affine[:3, :3] / steps,
        "transform": {"up": "z"},
    }
    return "volume", "image", arguments


def _simpleitk(thing: Any) -> tuple[str, str, dict[str, Any]] | None:
    """An image of SimpleITK. Its world has x to the left of the patient and y to the back; files of it are read with x to the right and y to the front, and
    so is the image."""
    library = sys.modules.get("SimpleITK")
    if library is None or not isinstance(thing, library.Image):
        return None
    if thing.GetDimension() != 3 or thing.GetNumberOfComponentsPerPixel() != 1:
        found = f"{thing.GetDimension()} axes and {thing.GetNumberOfComponentsPerPixel()} numbers a voxel"
        raise InputError(f"the image: expected three axes and one number a voxel, found {found}; take one of a series, or one channel")
    arguments = {
        "values": library.GetArrayViewFromImage(thing),
        "spacing": thing.GetSpacing(),
        "origin": _HALF_TURN * thing.GetOrigin(),
        "direction": _HALF_TURN[:, None] * np.asarray(thing.GetDirection()).reshape(3, 3),
        "transform": {"up": "z"},
    }
    return "volume", "image", arguments


# Names of the dimensions of arrays, in lower case.
_NAMES_OF_AXES = {
    "x": ("x", "lon", "longitude", "easting"),
    "y": ("y", "lat", "latitude", "northing"),
    "z": ("z", "depth", "height", "altitude", "elevation", "level"),
}


def _in_order(thing: Any) -> Any:
    """An array of xarray with its dimensions in the order z, y, x, by their names; as it is where none of them is known."""
    found = {axis: [dim for dim in thing.dims if str(dim).lower() in names] for axis, names in _NAMES_OF_AXES.items()}
    order = [dims[0] for axis in "zyx" if len(dims := found[axis]) == 1]
    if len(order) == 3:
        return thing.transpose(*order)
    if any(found.values()):
        expected = "the dimensions x, y and z (or longitude, latitude, depth …), or none that is called so, in the order z, y, x"
        raise InputError(f"the array: expected {expected}, found {tuple(thing.dims)}; `rename` gives others, `isel` takes a part")
    return thing


def _xarray(thing: Any) -> tuple[str, str, dict[str, Any]] | None:
    """An array of xarray: by the names of its dimensions where they are known, else in the order that it has."""
    if not hasattr(thing, "dims") or not hasattr(thing, "coords") or not hasattr(thing, "values"):
        return None
    if hasattr(thing, "data_vars"):
        raise InputError(f"the data set: expected one of its arrays, such as dataset[NAME], found those of {sorted(map(str, thing.data_vars))}")
    if len(thing.dims) != 3:
        raise InputError(f"the array: expected three dimensions, found {tuple(thing.dims)}; take a part by `isel`")
    thing = _in_order(thing)
    spacing, origin = [], []
    for dim in reversed(thing.dims):
        places = _places_along(thing, dim)
        if len(places) > 1 and places[0] > places[-1]:
            # From north to south, or from the top down.
            thing = thing.isel({dim: slice(None, None, -1)})
            places = places[::-1]
        steps = np.diff(places)
        if len(steps) and not np.allclose(steps, steps[0], rtol=1e-3):
            raise InputError(f"the coordinate {dim}: expected even steps, found {steps.min()} to {steps.max()}; interpolate it first")
        spacing.append(float(steps[0]) if len(steps) else 1.0)
        origin.append(float(places[0]))
    return "volume", str(thing.name or "volume"), {"values": thing.values, "spacing": spacing, "origin": origin}


def _places_along(thing: Any, dim: Any) -> np.ndarray:
    """The coordinates of an array of xarray along a dimension; counted where it has none."""
    if dim not in thing.coords:
        return np.arange(float(thing.sizes[dim]))
    places = np.asarray(thing.coords[dim].values)
    if places.dtype.kind not in "biuf":
        raise InputError(f"the coordinate {dim}: expected numbers, found those of type {places.dtype}; `drop_vars({str(dim)!r})` leaves steps of 1")
    return places.astype(float)


def _array(thing: Any) -> tuple[str, str, dict[str, Any]] | None:
    """An array: n rows of three numbers are points, three axes a volume."""
    if not hasattr(thing, "__array__") and not isinstance(thing, (list, tuple)):
        return None
    if isinstance(thing, (list, tuple)) and thing and all(isinstance(part, np.ndarray) and part.ndim == 2 and part.shape[1] == 3 for part in thing):
        raise InputError(f"the array: expected one, found a list of {len(thing)} with rows of three numbers; organza.render(*arrays) takes several, Scene.add each of them")
    array = array_of(thing, "the array")
    if array.ndim == 3:
        return "volume", "volume", {"values": array}
    if array.ndim == 2 and array.shape[1] == 3:
        return "points", "points", {"positions": array}
    raise InputError(f"the array: expected the shape (n, 3) of points or (nz, ny, nx) of a volume, found {array.shape}")
