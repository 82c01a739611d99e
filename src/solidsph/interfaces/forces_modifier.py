"""ForcesModifier: a term that changes how bodies act on themselves."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence

from solidsph.interfaces.engine import InternalForces
from solidsph.interfaces.terms import StressTerm, Term


class ForcesModifier(Term):
    """Replaces the internal forces, as fracture does."""

    @abstractmethod
    def modified(
        self, internal: InternalForces, stress_terms: Sequence[StressTerm]
    ) -> InternalForces:
        """The internal forces with this term.

        Args:
            internal: by the scene's engine, or by a modifier before this one.
            stress_terms: what changes the stress before forces are formed.

        Raises:
            SceneError: it does not go with the modifier before it.
        """
