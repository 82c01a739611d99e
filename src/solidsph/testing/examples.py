"""A part made from its name alone, with typical values where it needs parameters."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import attrs

from solidsph.registry import registry
from solidsph.registry.construct import construct

_BOX = {"type": "box", "lengths": [1.2, 0.8]}

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
    "c10": 1.5e5,  # [Pa]
    "c01": 0.4e5,  # [Pa]
    # Fibres of that rubber's stiffness; real ones stiffen so fast that at the 40 % of strain of the
    # kit their stress would be a million times its scale.
    "matrix_stiffness": 3e5,  # [Pa]
    "matrix_exponent": 0.5,  # [-]
    "fibre_stiffness": 2e5,  # [Pa]
    "fibre_exponent": 0.6,  # [-]
    "sheet_stiffness": 1e5,  # [Pa]
    "sheet_exponent": 0.4,  # [-]
    "coupling_stiffness": 0.5e5,  # [Pa]
    "coupling_exponent": 0.3,  # [-]
    "fibre": [0.8, 0.6, 0.0],
    "sheet": [-0.36, 0.48, 0.8],
    "yield_stress": 1e4,  # [Pa]; the kits strain by ten times as much and more
    "hardening": 2e4,  # [Pa]
    "saturation_stress": 1.5e4,  # [Pa]
    "saturation_exponent": 20.0,  # [-]
    "hardening_modulus": 2e4,  # [Pa]
    "hardening_exponent": 0.3,  # [-]
    "rate_coefficient": 0.02,  # [-]
    "softening_exponent": 1.1,  # [-]
    "melting_temperature": 500.0,  # [K]
    "specific_heat": 0.1,  # [J/(kg K)], so that such a soft solid warms at all
    "prony": [{"share": 0.4, "time": 1e-2}, {"share": 0.2, "time": 1.0}],  # [-], [s]
    "time": 1e-5,  # [s]
    "critical_stretch": 4e-4,  # [-]
    "conductivity": 50.0,  # [W/(m K)]
    "heat_capacity": 500.0,  # [J/(kg K)]
    "expansion": 1e-4,  # [1/K]
    "initial": "100*sin(4*X)",  # [K]
    "pressure": "1e3*sin(300*t)",  # [Pa]
    "point": {"x": 0.05},  # [m]
    "normal": {"x": 1.0},
    # Shapes
    "length": 1.3,  # [m]
    "lengths": [1.2, 0.8],  # [m]
    "radius": 0.5,  # [m]
    "inner_radius": 0.2,  # [m]
    "outer_radius": 0.5,  # [m]
    "vertices": [[0.0, 0.0], [1.2, 0.0], [0.5, 0.3], [0.0, 0.9]],  # [m]
    # Boundary handlers
    "where": "left",
    "axis": "x",
    "displacement": {"x": "0.002*sin(300*t)"},  # [m]
    "traction": {"x": "1e3*sin(300*t)"},  # [Pa]
    # Discretisations: on the rectangle of their kit, which the map takes to itself
    "before": _BOX,
    "to": {"x": "X + 0.05*sin(2*pi*X/1.2)"},  # [m]
    "positions": [[0.05 + 0.1 * i, 0.05 + 0.1 * j] for i in range(12) for j in range(8)],  # [m]
}

# Where a field of one name means something else in each kind.
TYPICAL_OF_KIND: Mapping[tuple[str, str], Any] = {
    ("discretisations", "of"): "lattice",
    ("shapes", "of"): [_BOX, {"type": "disc", "radius": 0.3, "centre": [1.2, 0.8]}],
    ("shapes", "minus"): {"type": "disc", "radius": 0.22, "centre": [0.6, 0.4]},
}

# Fields with a default that a part cannot do without all the same.
_OFFERED = (
    "positions",
    "expansion",
    "initial",
    "hardening",
    "saturation_stress",
    "saturation_exponent",
    "fibre",
    "sheet",
)


def example_part(kind: str, name: str, **parameters: Any) -> Any:
    """The part of that kind and name; required fields not in `parameters` take typical values.

    Raises:
        SceneError: no such part, a required field for which no typical value is known, or a value
            that the part refuses.
        PluginError: the part cannot be loaded.
    """
    cls = registry.load(kind, name)
    fields = attrs.fields(cls) if attrs.has(cls) else ()
    typical = {
        key: value
        for field in fields
        if field.init and (field.default is attrs.NOTHING or field.name in _OFFERED)
        for key in [field.alias or field.name]
        for value in [_typical(kind, key, str(field.type))]
        if value is not None
    }
    return construct(kind, {"type": name, **typical, **parameters})


def _typical(kind: str, key: str, annotation: str) -> Any:
    value = TYPICAL_OF_KIND.get((kind, key), TYPICAL.get(key))
    # One part where one is wanted: the first of several.
    if isinstance(value, list) and key == "of" and not annotation.startswith("tuple"):
        return value[0]
    return value
