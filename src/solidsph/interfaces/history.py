"""HistoryMaterial: a material with internal variables."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import ClassVar

from solidsph.interfaces.material import Material
from solidsph.maths.arrays import Scalar, Tensor

History = tuple[Scalar, ...]
"""Internal variables at a point, in the order of their names."""


class HistoryMaterial(Material):
    """A law with internal variables h, which advance once per step and live in `State.memory`.

    The stored energy psi(F, h) gives the stress P = dpsi/dF at fixed h. `advance` integrates h over
    a step, given F at its end: an implicit update of plastic flow, the exact decay of a viscous
    strain. The energy dissipated so far is one of the variables, so that the energy balance closes.

    All functions are pure and pointwise, in terms of `solidsph.maths.tensors`; h is a tuple of
    scalars. `energy`, `first_piola` and `tangent` are those of the virgin state, at the h of
    `initial_history`; `lame_parameters` are those of a sudden small strain.
    """

    shown: ClassVar[Sequence[str]] = ()
    """Names of the internal variables that are recorded as fields."""

    rate_dependent: ClassVar[bool] = False
    """True if the result of a step depends on its length, not on the strain alone."""

    @abstractmethod
    def initial_history(self, dimension: int) -> Mapping[str, float]:
        """Internal variables "quantity [unit]" of the virgin state, in the order of h."""

    def history_in_space(self, history: History, dimension: int) -> History:
        """Internal variables in three dimensions, of the same uniaxial or plane strain.

        With them the law gives the stress across the plane. By default the variables of the same
        names; those that only three dimensions have are as at the start.
        """
        own = dict(zip(self.initial_history(dimension), history, strict=True))
        return tuple(own.get(name, start) for name, start in self.initial_history(3).items())

    @staticmethod
    @abstractmethod
    def advance(F: Tensor, history: History, step: float, params: tuple[float, ...]) -> History:
        """h at the end of a step of length `step` [s] that ends at F.

        The dissipated energy must not decrease.
        """

    @staticmethod
    @abstractmethod
    def stored(F: Tensor, history: History, params: tuple[float, ...]) -> Scalar:
        """Stored energy psi(F, h) per reference volume [J/m^3]."""

    @staticmethod
    @abstractmethod
    def stress(F: Tensor, history: History, params: tuple[float, ...]) -> Tensor:
        """First Piola-Kirchhoff stress P = dpsi/dF at fixed h [Pa]."""

    @staticmethod
    @abstractmethod
    def dissipated(history: History) -> Scalar:
        """Energy dissipated since the virgin state, per reference volume [J/m^3]."""
