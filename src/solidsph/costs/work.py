"""Work: what a run has to do, in counts that are the same on every machine and in every run."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum

import attrs

from solidsph.interfaces.plan import Compilation, Operations


class Loop(Enum):
    """What goes from one evaluation of the forces to the next."""

    STEPS = "steps of arrays"
    COMPILED = "whole steps, compiled"
    NEWTON = "Newton's method"


@attrs.frozen
class StaticWork:
    """What is particular to an equilibrium; the iterations are a guess before they are done."""

    load_steps: int
    iterations: int
    freedoms: int  # unknowns
    entries: int  # of the tangent
    fill: int  # entries of its factors, by dissection of the body's box
    multiplications: int  # of the factorisation, by the same


@attrs.frozen
class Work:
    """A run, counted."""

    dimension: int
    particles: int  # ghosts among them
    pairs: int  # ordered pairs of neighbours within the support, self pairs included
    loop: Loop
    steps: int  # in time, or of the load
    evaluations: int  # of all forces
    operations: Sequence[Operations]  # of an evaluation: the engine's, then those of loads
    conditions: int  # loads and motions, each with an account
    outputs: int  # observed states, the first one among them
    record_bytes: int  # about
    compilations: frozenset[Compilation] = frozenset()
    statics: StaticWork | None = None
    counted: bool = True  # from a built scene; if not, estimated without building it
    cover: float = 0.0  # support radius in spacings [-]
    motions: int = 0  # conditions that determine motion, which cost a step by arrays more

    @property
    def visited(self) -> int:
        """Pairs that an evaluation visits, those of conditions included."""
        return sum(part.pairs for part in self.operations)

    @property
    def pair_evaluations(self) -> int:
        """Pairs visited in all evaluations: the work that no engine can avoid."""
        return self.evaluations * self.visited

    @property
    def touched(self) -> int:
        """Bytes that an evaluation must move at least."""
        return sum(part.touched for part in self.operations)

    @property
    def traffic(self) -> int:
        """Bytes that all evaluations must move at least."""
        return self.evaluations * self.touched

    @property
    def held(self) -> int:
        """Bytes of the arrays kept between evaluations."""
        return sum(part.held for part in self.operations)
