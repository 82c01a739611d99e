"""BoundaryHandler: a boundary condition and where it holds."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import ClassVar

from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.marks import Mark, marks_of
from solidsph.interfaces.part import Part
from solidsph.interfaces.terms import Term


class BoundaryHandler(Part):
    """Parameters of a boundary condition; `bind` applies it to particles.

    An implementation is a frozen attrs class whose fields are the TOML keys of the handler.
    """

    loads_surface: ClassVar[bool] = False
    """True if it loads a surface: that which `DiscreteModel.surface` gives for its `where`."""

    @abstractmethod
    def bind(self, model: DiscreteModel, label: str) -> Sequence[Term]:
        """Terms that impose the condition and report under `label`.

        Raises:
            SceneError: it matches no particle, or cannot be imposed on those that it matches.
        """

    def marks(self, model: DiscreteModel, label: str) -> Sequence[Mark]:
        """What a picture of the scene shows of it: by default what its terms hold, and their loads.

        A handler whose terms take long to form overrides this.

        Raises:
            SceneError: as `bind`.
        """
        return tuple(marks_of(self.bind(model, label), model.particles, model.end))
