"""Work of a run, in counts that do not depend on the machine."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum

import attrs

from solidsph.interfaces.plan import Compilation, Operations


class Loop(Enum):
    """Loop around the evaluations of the forces."""

    STEPS = "steps of arrays"
    COMPILED = "whole steps, compiled"
    NEWTON = "Newton's method"


@attrs.frozen
class StaticWork:
    """Additional counts of an equilibrium; the number of iterations is an estimate."""

    load_steps: int
    iterations: int
    freedoms: int  # unknowns
    entries: int  # of the tangent
    fill: int  # entries of its factors, estimated for the body's box
    multiplications: int  # of the factorisation, likewise
    banded: bool = False  # the factors are kept in a band
    products: int = 0  # with the tangent in all, an estimate; 0 if it is factorised


@attrs.frozen
class Work:
    """Counts of one run."""

    dimension: int
    particles: int  # ghosts included
    pairs: int  # ordered pairs within the support, self pairs included
    loop: Loop
    steps: int  # time steps or load steps
    evaluations: int  # of all forces
    operations: Sequence[Operations]  # per evaluation: the engine's, then those of loads
    conditions: int  # loads and motions, each with an account
    outputs: int  # observed states, the first included
    record_bytes: int  # about
    compilations: frozenset[Compilation] = frozenset()
    statics: StaticWork | None = None
    counted: bool = True  # False if estimated without building the scene
    cover: float = 0.0  # support radius [spacings]
    motions: int = 0  # conditions that determine motion, which cost more per step of arrays

    @property
    def visited(self) -> int:
        """Pairs visited per evaluation, those of loads included."""
        return sum(part.pairs for part in self.operations)

    @property
    def pair_evaluations(self) -> int:
        """Pairs visited in the whole run: the work that no engine can avoid."""
        return self.evaluations * self.visited

    @property
    def touched(self) -> int:
        """Least memory traffic of an evaluation [bytes]."""
        return sum(part.touched for part in self.operations)

    @property
    def traffic(self) -> int:
        """Least memory traffic of all evaluations [bytes]."""
        return self.evaluations * self.touched

    @property
    def held(self) -> int:
        """Memory of the arrays kept between evaluations [bytes]."""
        return sum(part.held for part in self.operations)
