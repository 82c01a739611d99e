"""Effect: one optional term of the equation of motion."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from enum import Enum
from typing import ClassVar

from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.marks import Mark
from solidsph.interfaces.part import Part
from solidsph.interfaces.terms import Load


class Need(Enum):
    """A problem that a scene may have and an effect may solve."""

    SHOCKS = "fronts steeper than the particles resolve"
    UNSEEN_MOTIONS = "motions that the gradient does not see"
    REST = "a motion that is to come to rest"
    MEETING = "bodies that meet, or hang together"


class Effect(Part):
    """Parameters of an optional term; a scene that does not name it does not run any of its code.

    An implementation is a frozen attrs class whose fields are the TOML keys of the effect.
    """

    conserves_momentum: ClassVar[bool] = False
    """True if its forces on a free body, and their moments, add up to zero for any motion."""

    breaks_bonds: ClassVar[bool] = False
    """True if it can sever neighbour pairs (fracture)."""

    uses_initial_pairs: ClassVar[bool] = False
    """True if it acts on the initial neighbour pairs even after they are severed."""

    at_cell_centres: ClassVar[bool] = False
    """True if its sums suit particles at the centres of cells, and a gradient that is formed
    particle by particle: a scene gets the scheme `corrected` then, not the recommended one."""

    answers: ClassVar[frozenset[Need] | None] = None
    """Needs that it answers, from which `solidsph.advice` finds effects that are missing or not
    needed; empty if it serves another purpose. None is undeclared: no need is then reported."""

    @abstractmethod
    def bind(self, model: DiscreteModel, label: str) -> Load:
        """The load on the particles of `model`; its energy account is called `label`.

        Raises:
            SceneError: it matches no particle, or its parameters do not fit the model.
        """

    def marks(self, model: DiscreteModel, label: str) -> Sequence[Mark]:
        """What a picture of the scene shows of it; nothing by default.

        Raises:
            SceneError: as `bind`.
        """
        return ()

    def pair_work(self, particles: float, pairs: float) -> float:
        """Estimated number of pairs that one evaluation of its forces visits, for cost estimates.

        Args:
            particles: number of particles in the scene.
            pairs: number of ordered pairs within the support, self pairs included.
        """
        return 0.0
