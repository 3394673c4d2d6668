"""Paths of keys in a scene, such as ``object.scan.opacity``."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from typing import Any

from organza._organza import InputError

# Tables and lists whose entries have names of a user.
_NAMED = ("object", "light", "material")
# A key in the quotes of TOML: with escapes, or as it is.
_QUOTED = re.compile(r'"(?:[^"\\]|\\.)*"|\'[^\']*\'')


def path_in(document: Mapping[str, Any], path: str) -> list[str]:
    """The keys of a path. A name with dots is that of an entry of the document, or stands in quotes."""
    parts: list[str] = []
    rest = path
    while True:
        is_name = len(parts) == 1 and parts[0] in _NAMED
        part, rest = _quoted(path, rest) if rest[:1] in ("'", '"') else _plain(document.get(parts[0]) if is_name else None, path, rest)
        parts.append(part)
        if not rest:
            return parts
        rest = rest[1:]


def _quoted(path: str, rest: str) -> tuple[str, str]:
    """A key in quotes, and what follows it."""
    found = _QUOTED.match(rest)
    end = found.end() if found else 0
    if not found or rest[end : end + 1] not in ("", "."):
        raise InputError(f"{path}: expected a key in quotes with a dot or nothing behind it, found {rest}")
    key = found.group()
    try:
        part = key[1:-1] if key[0] == "'" else str(json.loads(key))
    except json.JSONDecodeError as error:
        raise InputError(f"{path}: expected a key in quotes, found {key}: {error.msg}") from None
    return part, rest[end:]


def _plain(entries: Any, path: str, rest: str) -> tuple[str, str]:
    """A key without quotes: the name of an entry with all of its dots, or what stands before the first one; and what follows it."""
    names = _names(entries)
    begun = [name for name in names if rest.startswith(f"{name}.")]
    if len(begun) > 1:
        listed = ", ".join(repr(name) for name in begun)
        quoted = " or ".join(path[: len(path) - len(rest)] + json.dumps(name, ensure_ascii=False) + rest[len(name) :] for name in begun)
        raise InputError(f"{path}: expected one name, found the beginnings {listed}; quotes tell them apart: {quoted}")
    part = begun[0] if begun else rest if rest in names else rest.partition(".")[0]
    return part, rest[len(part) :]


def _names(entries: Any) -> list[str]:
    """The names of the entries of a list or a table."""
    if isinstance(entries, Mapping):
        return [str(name) for name in entries]
    return [str(entry["name"]) for entry in entries or [] if "name" in entry]


__all__ = ["path_in"]
