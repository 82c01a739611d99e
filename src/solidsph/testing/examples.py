"""A part made from its name alone, with typical values where it needs parameters."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import attrs

from solidsph import registry
from solidsph.parts import construct

# By the name of the field. Soft rubber; any values of one solid would do.
TYPICAL: Mapping[str, Any] = {
    "youngs_modulus": 1e6,  # [Pa]
    "poissons_ratio": 0.3,  # [-]
    "shear_modulus": 1e6 / 2.6,  # [Pa], of the same solid
    "bulk_modulus": 1e6 / 1.2,  # [Pa], of the same solid
    "density": 1000.0,  # [kg/m^3]
    "acceleration": {"x": "-9.81*cos(50*t)"},  # [m/s^2]
    "amplitude": 0.2,  # [-]
    "rate": 20.0,  # [1/s]
    "seed": 1,
}


def example_part(kind: str, name: str, **parameters: Any) -> Any:
    """The part of that kind and name; required fields not in `parameters` take typical values.

    Raises:
        SceneError: no such part, a required field for which no typical value is known, or a value
            that the part refuses.
        PluginError: the part cannot be loaded.
    """
    cls = registry.load(kind, name)
    needed = [
        field.alias or field.name
        for field in (attrs.fields(cls) if attrs.has(cls) else ())
        if field.init and field.default is attrs.NOTHING
    ]
    typical = {key: TYPICAL[key] for key in needed if key in TYPICAL}
    return construct(kind, {"type": name, **typical, **parameters})
