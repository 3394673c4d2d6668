"""Names of arguments and keys, which are checked when a call is made."""

from __future__ import annotations

import difflib
import functools
import inspect
import json
from collections.abc import Callable, Iterable, Mapping
from typing import Any, ParamSpec, TypeVar

from organza import _organza
from organza._organza import InputError

_Parameters = ParamSpec("_Parameters")
_Result = TypeVar("_Result")

# Words of other libraries that resemble no argument of this one.
_KNOWN_ELSEWHERE = {"alpha": "opacity", "vmin": "clim", "vmax": "clim", "c": "colors", "scalars": "values", "norm": "log_scale", "size": "radius"}
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
        if key not in object_keys():
            raise InputError(f"{call.__name__}, '{label}': expected an argument or a key of an object, found `{key}`{meant(key, known - {key})}")


def of_object(call: Callable[_Parameters, _Result]) -> Callable[_Parameters, _Result]:
    """The method that adds an object, whose errors name the object where the caller does."""

    @functools.wraps(call)
    def checked(*values: _Parameters.args, **keywords: _Parameters.kwargs) -> _Result:
        try:
            return call(*values, **keywords)
        except InputError as error:
            name = keywords.get("name")
            if not isinstance(name, str) or f"'{name}" in str(error):
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
                raise TypeError(f"{call.__name__}: expected one of its arguments, found `{name}`{meant(name, known)}")
        return call(*values, **keywords)

    return checked


__all__ = ["arguments_of", "check_keys", "meant", "named", "object_keys", "of_object"]
