"""Fields of shapes that are read from files."""

from __future__ import annotations

from pathlib import Path
from reprlib import repr as short
from typing import Any

import attrs

from solidsph.interfaces.shape import Shape
from solidsph.system.files import content, located, working_folder
from solidsph_builtin.shapes._checks import as_number, is_number, refusal


def path_field() -> Any:
    """An attrs field that holds the path of a file, or None."""
    return attrs.field(default=None, converter=_as_text, validator=_check_path)


def angle_field() -> Any:
    """An attrs field that holds the angle from which an edge or a corner is sharp [degrees]."""
    return attrs.field(default=30.0, converter=as_number, validator=_check_angle)


def read_bytes(path: str, most: int) -> bytes:
    """The content of the file of a shape.

    Raises:
        OSError: it is not there, cannot be read, or has more than `most` bytes.
    """
    try:
        return content(located(path), most)
    except FileNotFoundError as cause:
        begin = "" if Path(path).is_absolute() else f"; its path begins in {working_folder()}"
        raise FileNotFoundError(f"No such file{begin}") from cause


def _as_text(value: Any) -> Any:
    return str(value) if isinstance(value, Path) else value


def _check_path(shape: Shape, field: attrs.Attribute[Any], value: object) -> None:
    if not (value is None or isinstance(value, str)):
        raise refusal(shape, field.name, "the path of a file", short(value))


def _check_angle(shape: Shape, field: attrs.Attribute[Any], value: object) -> None:
    if not (isinstance(value, float) and is_number(value) and 0.0 < value <= 180.0):
        raise refusal(shape, field.name, "an angle above 0 and up to 180 degrees", short(value))
