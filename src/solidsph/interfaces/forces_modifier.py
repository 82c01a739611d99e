"""ForcesModifier: a term that changes the internal forces of bodies."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence

from solidsph.interfaces.engine import InternalForces
from solidsph.interfaces.terms import StressTerm, Term


class ForcesModifier(Term):
    """A term that replaces the internal forces, as fracture does."""

    @abstractmethod
    def modified(
        self, internal: InternalForces, stress_terms: Sequence[StressTerm]
    ) -> InternalForces:
        """The internal forces with this term.

        Args:
            internal: forces by the scene's engine, or by the modifier before this one.
            stress_terms: terms that change the stress before forces are formed.

        Raises:
            SceneError: it cannot be combined with the modifier before it.
        """
