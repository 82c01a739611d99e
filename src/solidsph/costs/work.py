"""Work: what a run has to do, in counts that are the same on every machine and in every run."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum

import attrs

from solidsph.interfaces.operation_count import Tally


class Loop(Enum):
    """What goes from one evaluation of the forces to the next."""

    STEPS = "steps of arrays"
    COMPILED = "whole steps, compiled"
    NEWTON = "Newton's method"


class Piece(Enum):
    """What may have to be compiled; each once a process and kind."""

    ENGINE = "the engine, laws and the layout of rows"
    MOVING_ENGINE = "the engine, laws and the search for neighbours"
    FORCES = "sums over neighbours, from displacement to force at once"
    STAGED = "sums over neighbours, stress between"
    MOVING = "sums over moving neighbours"
    FIELDS = "deformation for reports"
    STEPS = "the time loop"
    LOAD = "a load in the time loop"
    PAIR_LOAD = "forces of pairs in the time loop"
    HOURGLASS_LOAD = "hourglass forces in the time loop"
    SWEEPS = "hourglass forces outside of it"
    EXTENSION = "ghosts that follow in the time loop"


@attrs.frozen
class Compilation:
    """Something to compile; two that are equal are compiled once."""

    piece: Piece
    dimension: int
    threaded: bool
    key: object = None  # what tells those of one piece apart


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
    tally: Sequence[Tally]  # what an evaluation passes over: the engine's, and that of conditions
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
        return sum(part.pairs for part in self.tally)

    @property
    def pair_evaluations(self) -> int:
        """Pairs visited in all evaluations: the work that no engine can avoid."""
        return self.evaluations * self.visited

    @property
    def touched(self) -> int:
        """Bytes that an evaluation must move at least."""
        return sum(part.touched for part in self.tally)

    @property
    def traffic(self) -> int:
        """Bytes that all evaluations must move at least."""
        return self.evaluations * self.touched

    @property
    def held(self) -> int:
        """Bytes of the arrays kept between evaluations."""
        return sum(part.held for part in self.tally)
