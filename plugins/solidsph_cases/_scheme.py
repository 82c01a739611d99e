"""The scenes of cases: a body of a material, and the scheme that the user chooses for it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

from solidsph.errors import SceneError
from solidsph.interfaces.material import Material
from solidsph.registry.construct import describe
from solidsph.registry.parameters import check_positive
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.simulation import Simulation
from solidsph_builtin.materials.neo_hookean import NeoHookean

ON_BOUNDARY: Mapping[str, Any] = {"type": "lattice", "on_boundary": True}
FITTED: Mapping[str, Any] = {"type": "fitted-moments", "of": ON_BOUNDARY}
SOFT = NeoHookean(youngs_modulus=1e6, poissons_ratio=0.3, density=1000.0)


class Scheme(Protocol):
    """The parameters by which a cost study sweeps a case."""

    @property
    def kernel(self) -> str: ...  # name
    @property
    def cover(self) -> float: ...  # [spacings]
    @property
    def gradient(self) -> str: ...  # name
    @property
    def hourglass(self) -> float: ...  # strength of hourglass control [-]; 0 adds none
    @property
    def engine(self) -> str: ...  # name


class MovingScheme(Scheme, Protocol):
    """The same with the parameters of the integration in time."""

    @property
    def integrator(self) -> str: ...  # name
    @property
    def time_step_factor(self) -> float: ...  # of the largest step


def with_scheme(builder: SceneBuilder, scheme: Scheme) -> SceneBuilder:
    """`builder` with the kernel, the total Lagrangian form, the engine and hourglass control."""
    builder = (
        builder.kernel(scheme.kernel, cover=scheme.cover)
        .formulation("total-lagrangian", gradient=scheme.gradient, divergence="variational")
        .engine(scheme.engine)
    )
    if scheme.hourglass == 0.0:
        return builder
    return builder.effect("hourglass-control", strength=scheme.hourglass)


def in_motion(
    builder: SceneBuilder, scheme: MovingScheme, duration: float, outputs: int
) -> SceneBuilder:
    """`builder` with the scheme, integrated over `duration` [s]."""
    builder = builder.integrator(scheme.integrator, time_step_factor=scheme.time_step_factor)
    return with_scheme(builder.duration(duration).outputs(outputs), scheme)


def solid(
    title: str,
    name: str,
    shape: Mapping[str, Any],
    spacing: float,
    material: Material,
    **options: Any,
) -> SceneBuilder:
    """A scene with one body.

    Args:
        name: of the body.
        spacing: of its particles [m].
        options: of the body, such as its discretisation and its tags.
    """
    builder = Simulation.builder().title(title)
    builder = builder.body(name, shape=shape, spacing=spacing, **options)
    return builder.material(describe("materials", material))


def box(*lengths: float, origin: list[float] | None = None) -> Mapping[str, Any]:
    """A box with sides of those lengths [m], with a corner at `origin` or at 0."""
    shape = {"type": "box", "lengths": list(lengths)}
    return shape if origin is None else {**shape, "origin": origin}


def between_walls(builder: SceneBuilder, dimension: int) -> SceneBuilder:
    """`builder` with frictionless walls on all sides across the x axis."""
    sides = {"y": ("bottom", "top"), "z": ("back", "front")}
    for axis in "yz"[: dimension - 1]:
        for side in sides[axis]:
            builder = builder.boundary("clamp", where=side, axes=[axis])
    return builder


def check_count(case: str, name: str, value: object, least: int) -> None:
    """Raise SceneError unless `value` is a whole number of at least `least`."""
    if isinstance(value, bool) or not isinstance(value, int) or value < least:
        raise SceneError(
            f"case {case!r}: {name} must be a whole number of at least {least}, got {value!r}"
        )


def check_all_positive(label: str, case: object, **units: str) -> None:
    """Raise SceneError unless every parameter named in `units` is positive and finite."""
    for name, unit in units.items():
        check_positive(label, name, getattr(case, name), unit.replace("_", " "))
