"""Materials that remember: the stress depends on what has been, not on F alone."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import ClassVar

from solidsph.interfaces.material import Material
from solidsph.maths.arrays import Scalar, Tensor

History = tuple[Scalar, ...]
"""Internal variables at a point, in the order of their names."""


class HistoryMaterial(Material):
    """A law with internal variables h, which advance once a step and live in `State.memory`.

    The stored energy psi(F, h) gives the stress P = dpsi/dF at fixed h, and `advance` carries h
    over a step to the F at its end: an implicit update of plastic flow, the exact decay of a
    viscous strain. What that dissipates is one of the variables, so that the ledger closes.

    All are pure pointwise functions in the words of `solidsph.maths.tensors`; h is a tuple of
    scalars. What `Material` asks for is the law of the virgin state: `energy`, `first_piola` and
    `tangent` are those at the h of `initial_history`, and `lame_parameters` those of a sudden small
    strain.
    """

    shown: ClassVar[Sequence[str]] = ()
    """Names among the internal variables that records keep as fields."""

    rate_dependent: ClassVar[bool] = False
    """Whether the length of a step matters, not only where it leads."""

    @abstractmethod
    def initial_history(self, dimension: int) -> Mapping[str, float]:
        """Internal variables "quantity [unit]" in the virgin state, in the order of h."""

    @staticmethod
    @abstractmethod
    def advance(F: Tensor, history: History, step: float, params: tuple[float, ...]) -> History:
        """h at the end of a step of `step` [s] that ends at F; at least as much is dissipated."""

    @staticmethod
    @abstractmethod
    def stored(F: Tensor, history: History, params: tuple[float, ...]) -> Scalar:
        """psi(F, h) per reference volume [J/m^3]; `energy` is that of the virgin state."""

    @staticmethod
    @abstractmethod
    def stress(F: Tensor, history: History, params: tuple[float, ...]) -> Tensor:
        """P = dpsi/dF at fixed h [Pa]."""

    @staticmethod
    @abstractmethod
    def dissipated(history: History) -> Scalar:
        """What has been dissipated since the virgin state, per reference volume [J/m^3]."""
