"""BoundaryHandler: what is imposed, and where."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import ClassVar

from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.part import Part
from solidsph.interfaces.terms import Term


class BoundaryHandler(Part):
    """Parameters of what is imposed; `bind` makes it act on particles.

    An implementation is a frozen attrs class whose fields are the TOML keys of the handler. One
    that loads a surface says so, and takes what `DiscreteModel.surface` finds at its `where`.
    """

    loads_surface: ClassVar[bool] = False

    @abstractmethod
    def bind(self, model: DiscreteModel, label: str) -> Sequence[Term]:
        """The conditions that impose it, reporting under `label`.

        Raises:
            SceneError: it matches no particle, or cannot be imposed on those it matches.
        """
