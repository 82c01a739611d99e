"""A part made from its name alone, with the values of its own example."""

from __future__ import annotations

from typing import Any

import attrs

from solidsph.errors import SceneError
from solidsph.registry import registry
from solidsph.registry.construct import construct


def example_part(kind: str, name: str, **parameters: Any) -> Any:
    """The part of that kind and name; fields not in `parameters` have the values of its `example`.

    Raises:
        SceneError: no such part, a required parameter that has no example, or a value that the
            part refuses.
        PluginError: the part cannot be loaded.
    """
    cls = registry.load(kind, name)
    table = {**cls.example, **parameters}
    missing = [
        key
        for field in (attrs.fields(cls) if attrs.has(cls) else ())
        for key in [field.alias or field.name]
        if field.init and field.default is attrs.NOTHING and key not in table
    ]
    if missing:
        entry = registry.find(kind, name)
        raise SceneError(
            f"{registry.singular(kind)} {name!r}: there is no example value for the parameter "
            f"{', '.join(map(repr, missing))}; add it to `example` in {entry.target}, or give it, "
            f"such as --set {missing[0]}=1.0"
        )
    return construct(kind, {"type": name, **table})
