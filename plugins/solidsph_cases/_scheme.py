"""What every benchmark lets its user choose: how it is discretised, and by which engine."""

from __future__ import annotations

from typing import Protocol

from solidsph.errors import SceneError
from solidsph.scene.scene_builder import SceneBuilder


class Scheme(Protocol):
    """The parameters by which a cost study sweeps a case."""

    @property
    def kernel(self) -> str: ...  # name
    @property
    def cover(self) -> float: ...  # [spacings]
    @property
    def gradient(self) -> str: ...  # name
    @property
    def hourglass(self) -> float: ...  # strength of hourglass control [-]; 0 names none
    @property
    def engine(self) -> str: ...  # name


def with_scheme(builder: SceneBuilder, scheme: Scheme) -> SceneBuilder:
    """`builder` with the kernel, the total Lagrangian form, the engine and, if any, the control."""
    builder = (
        builder.kernel(scheme.kernel, cover=scheme.cover)
        .formulation("total-lagrangian", gradient=scheme.gradient, divergence="variational")
        .engine(scheme.engine)
    )
    if scheme.hourglass == 0.0:
        return builder
    return builder.effect("hourglass-control", strength=scheme.hourglass)


def check_count(case: str, name: str, value: object, least: int) -> None:
    """Raise SceneError unless `value` is a whole number of at least `least`."""
    if isinstance(value, bool) or not isinstance(value, int) or value < least:
        raise SceneError(
            f"case {case!r}: {name} must be a whole number of at least {least}, got {value!r}"
        )
