"""How an equilibrium's linear systems are solved: by a factorisation or by iteration."""

from __future__ import annotations

AUTOMATIC, DIRECT, ITERATIVE = "automatic", "direct", "iterative"

SOLVERS = (AUTOMATIC, DIRECT, ITERATIVE)

# Free displacements from which iterating takes less time or memory, by dimension: a factorisation
# couples neighbours of neighbours, some 400 particles a particle in space. In the plane it is as
# fast for ten thousand particles, and does not depend on how soft the scheme's softest motions are.
_MANY = {1: 10**9, 2: 60_000, 3: 1_500}

# Products with the tangent in one equilibrium, roughly, each two passes as an evaluation makes.
PRODUCTS = 400


# Load steps of bodies that remember: what flows does so in each of them along a straight path. The
# force that draws a plate to ten times its first yield changes by 0.05 % from one step to these.
_REMEMBERING = 20


def load_steps(wanted: int | None, *, remembers: bool) -> int:
    """Initial number of load steps of a scene that wants so many, or says nothing."""
    return wanted if wanted is not None else _REMEMBERING if remembers else 1


def iterates(solver: str, dimension: int, unknowns: int) -> bool:
    """Whether `solver` is to iterate for this number of unknowns, where the scene allows it."""
    return solver == ITERATIVE or (solver == AUTOMATIC and unknowns > _MANY[dimension])


def expected_evaluations(solver: str, dimension: int, unknowns: int) -> int:
    """About how many evaluations of the forces the solver's work is worth."""
    return PRODUCTS if iterates(solver, dimension, unknowns) else 1
