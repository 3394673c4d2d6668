"""Names of arguments and keys, which are checked when a call is made."""

from __future__ import annotations

import difflib
import functools
import inspect
import json
import reprlib
from collections.abc import Callable, Iterable, Mapping
from typing import Any, ParamSpec, TypeVar

from organza import _organza
from organza._organza import InputError
from organza.values import text

_Parameters = ParamSpec("_Parameters")
_Result = TypeVar("_Result")

# Words of other libraries that resemble no argument of this one.
_KNOWN_ELSEWHERE = {"alpha": "opacity", "vmin": "clim", "vmax": "clim", "c": "colors", "scalars": "values", "norm": "log_scale", "size": "radius", "pos": "position", "map": "colormap"}
# Arguments of which no key of an object is near, by the words that users have for them.
_INSTEAD = {
    "add_volume": {
        "colormap": "`transfer=og.transfer({value})` takes a map",
        "cmap": "`transfer=og.transfer({value})` takes a map",
        "map": "`transfer=og.transfer({value})` takes a map",
        "clim": "`transfer=og.transfer(clim={value})` takes the ends of the map",
        "vmin": "`transfer=og.transfer(clim=({value}, None))` takes the ends of the map",
        "vmax": "`transfer=og.transfer(clim=(None, {value}))` takes the ends of the map",
        "window": "`transfer=og.transfer(clim=(level - window / 2, level + window / 2))` takes the ends of the map",
    },
    "": {"point_size": "`radius` takes a number, in the unit of the positions"},
}
# What takes the place of a width or a height.
_SIZE = "; `size=(width, height)` takes both"
# Arguments of one picture alone, and what takes them.
_GOAL_KEYS = ("budget_ms", "max_rmse", "max_flip")
_GOAL = "; one picture of organza.render keeps to it"
# Likeness from which another name is meant, of 1.
_LIKE = 0.6


@functools.cache
def object_keys() -> frozenset[str]:
    """The keys that an object of a scene has beside its name and its source."""
    schema = json.loads(_organza.schema())
    properties = schema["$defs"]["Object"]["properties"]
    sources = ("mesh", "points", "volume", "extract", "implicit", "isosurface", "level_set", "union", "intersection", "difference", "slice", "density")
    shapes = ("cloud", "rectangle", "medium_box", "medium_ball")
    return frozenset(properties) - {"name", *sources, *shapes}


@functools.cache
def arguments_of(call: Callable[..., Any]) -> tuple[str, ...]:
    """The names of the arguments of a function or a method."""
    parameters = inspect.signature(call).parameters.values()
    return tuple(parameter.name for parameter in parameters if parameter.kind is not parameter.VAR_KEYWORD and parameter.name != "self")


def meant(name: str, known: Iterable[str]) -> str:
    """A question for the known name that is nearest to another one; empty where none is near."""
    names = sorted(known)
    elsewhere = _KNOWN_ELSEWHERE.get(name)
    if elsewhere in names:
        return f"; did you mean `{elsewhere}`?"
    near = difflib.get_close_matches(name, names, 1, _LIKE)
    return f"; did you mean `{near[0]}`?" if near else ""


def check_keys(call: Callable[..., Any], label: str, keys: Mapping[str, Any]) -> None:
    """Refuses keys of an object that are neither arguments of the call nor keys of scenes."""
    known = {*arguments_of(call), *object_keys()}
    for key in keys:
        instead = _INSTEAD.get(call.__name__, {}).get(key)
        if instead is None and not isinstance(keys[key], Mapping):
            instead = _INSTEAD[""].get(key)
        if instead is not None:
            value = reprlib.repr(keys[key])
            raise InputError(f"{call.__name__}, '{label}': expected an argument or a key of an object, found `{key}`; {instead.format(value=value)}")
        if key not in object_keys():
            raise InputError(f"{call.__name__}, '{label}': expected an argument or a key of an object, found `{key}`{meant(key, known - {key})}")


@functools.cache
def sun_keys() -> frozenset[str]:
    """The keys of a directional light that a sun takes beside its arguments."""
    kinds = json.loads(_organza.schema())["$defs"]["Light"]["oneOf"]
    properties = next(kind["properties"] for kind in kinds if kind["properties"]["kind"].get("const") == "directional")
    return frozenset(properties) - {"kind", "name", "direction", "irradiance"}


def check_sun_keys(call: Callable[..., Any], label: str, keys: Mapping[str, Any]) -> None:
    """Refuses keys of a sun that are neither its arguments nor keys of a directional light."""
    known = [name for name in arguments_of(call) if name != "keys"] + sorted(sun_keys())
    for key in keys:
        if key not in sun_keys():
            raise InputError(f"light '{label}': expected one of {', '.join(known)}, found `{key}`{meant(key, known)}")


def of_object(call: Callable[_Parameters, _Result]) -> Callable[_Parameters, _Result]:
    """The method that adds an object, whose errors name the object where the caller does."""

    @functools.wraps(call)
    def checked(*values: _Parameters.args, **keywords: _Parameters.kwargs) -> _Result:
        name = text("name", keywords.get("name"), "a text")
        try:
            return call(*values, **keywords)
        except InputError as error:
            if name is None or f"'{name}" in str(error):
                raise
            raise InputError(f"object '{name}', {error}") from None

    return checked


def named(call: Callable[_Parameters, _Result]) -> Callable[_Parameters, _Result]:
    """The function, which refuses names of arguments that it does not have with the one that may be meant."""

    @functools.wraps(call)
    def checked(*values: _Parameters.args, **keywords: _Parameters.kwargs) -> _Result:
        known = arguments_of(call)
        for name in keywords:
            if name not in known:
                # A call of the camera itself is that of `camera`.
                called = "camera" if call.__name__ == "__call__" else call.__name__
                question = _SIZE if name in ("width", "height") and "size" in known else meant(name, known) or f"; they are {', '.join(known)}"
                question = _GOAL if name in _GOAL_KEYS else question
                raise TypeError(f"{called}: expected one of its arguments, found `{name}`{question}")
        return call(*values, **keywords)

    return checked


__all__ = ["arguments_of", "check_keys", "check_sun_keys", "meant", "named", "object_keys", "of_object", "sun_keys"]
