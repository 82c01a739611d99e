"""Effect: one optional term of the equation of motion."""

from __future__ import annotations

from abc import abstractmethod
from enum import Enum
from typing import TYPE_CHECKING, ClassVar

from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.part import Part
from solidsph.interfaces.terms import Load

if TYPE_CHECKING:
    pass


class Need(Enum):
    """What a scene may call for, and an effect answer."""

    SHOCKS = "fronts steeper than the particles resolve"
    UNSEEN_MOTIONS = "motions that the gradient does not see"
    REST = "a motion that is to come to rest"
    MEETING = "bodies that meet, or hang together"


class Effect(Part):
    """A term that a scene names, and pays for; a scene that does not name it runs none of it.

    An implementation is a frozen attrs class whose fields are the TOML keys of the effect.
    """

    conserves_momentum: ClassVar[bool] = False
    """Whether its forces on a free body, and their moments, add up to zero whatever the motion."""

    breaks_bonds: ClassVar[bool] = False
    """True if it can sever neighbour pairs (fracture)."""

    uses_initial_pairs: ClassVar[bool] = False
    """True if it acts between the neighbours of the start even after they are severed."""

    answers: ClassVar[frozenset[Need] | None] = None
    """What it is for, by which a scene is told what it lacks or has in vain (`solidsph.advice`);
    empty for something else. None does not say: beside it nothing is said to be lacking."""

    @abstractmethod
    def bind(self, model: DiscreteModel, label: str) -> Load:
        """The term acting on particles; its energy account is called `label`.

        Raises:
            SceneError: it matches no particle, or its parameters do not fit the model.
        """

    def pair_work(self, particles: float, pairs: float) -> float:
        """Pairs that an evaluation of its forces visits, by what the cost of a run is estimated.

        Args:
            particles: how many the scene has.
            pairs: ordered ones within the support, self pairs included.
        """
        return 0.0
