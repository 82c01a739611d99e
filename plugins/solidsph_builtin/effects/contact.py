"""Contact between bodies, and of a body with itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import ClassVar, final

import attrs
import numpy as np
from scipy.sparse import csr_array

from solidsph.errors import SceneError
from solidsph.interfaces.body import Body
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.effect import Effect, Need
from solidsph.interfaces.memory import Memory
from solidsph.interfaces.terms import EnergyTerm, FieldTerm, Load, Observation
from solidsph.maths.arrays import Array, Indices
from solidsph.registry.parameters import check_positive, number
from solidsph_builtin.effects._contact_stiffness import friction_stiffness, normal_stiffness, spread
from solidsph_builtin.effects._meeting import Meeting, Touch
from solidsph_builtin.effects._meeting_of_bodies import meeting_of
from solidsph_builtin.effects._search import together

_NAMES = ("x", "y", "z")


@final
@attrs.frozen
class Contact(Effect):
    """Repulsion of two bodies whose volume fractions add up to more than one.

    Let S_B(x_a) = sum over b of V_b W(x_a - x_b) be the volume fraction of body B around x_a,
    smoothed over 2.5 spacings, the larger of a and b. A particle a of body A has the room r_a, the
    volume fraction at a of a body whose plane face lies on the surface of A, and the excess
    o_a = max(0, S_B(x_a) - r_a). The energy

        U = K / 2 (sum over a of V_a o_a^2 + sum over b of V_b o_b^2)

    has the form of the embedded-atom method, Daw & Baskes (1984). It depends on distances only, so
    its exact derivative is a force along the line between two particles, opposite at its ends, and
    momentum, angular momentum and energy are conserved. Bodies touch where their surfaces are, for
    any spacings: r_a follows from the depth of a below its surface and from the rows of particles
    of B, and is at least S_B in the reference configuration, where bodies are apart by definition.
    The usual pair force with a range of one spacing lets a lattice sink into another one, half a
    spacing off, by 0.13 spacings, so that sliding bodies interlock; here it is below 0.001.

    Bodies whose spacing varies may be refined where they touch. The reach of W is that of each
    pair, and r_a the mean of the rooms that the particles of B nearby leave, weighted by their
    parts of S_B: it follows the spacing on both sides, and is still a function of distances alone.

    K makes the contact as compliant as `1 / strength` spacings of material with the harmonic mean
    of both confined moduli. Deep inside, where S_B is constant, there is no force: a body may pass
    if the strength is too low or a body is thinner than two spacings.

    With `friction`, every particle with an excess has a tangential spring that slides at this
    fraction of its normal force: Coulomb's law with an elastic displacement as small as that of the
    contact itself (Cundall & Strack 1979). The spring acts on the particles of the other body
    nearby, moment included. The stretches are in `State.memory`.

    Particles of one body touch only if they were more than two reaches apart, so a crease
    does not close. The search begins when the boxes of two bodies come within `margin` of the
    largest reach. All particles in both boxes take part, so that deep penetration is not missed; of
    a body with itself, only those near its surface.
    """

    conserves_momentum: ClassVar[bool] = True
    answers: ClassVar[frozenset[Need] | None] = frozenset({Need.MEETING})

    between: Sequence[Sequence[str]] | None = None  # pairs of names of bodies; all if none
    itself: Sequence[str] = ()  # names of bodies that may touch themselves; ["all"] for each
    friction: float = number(default=0.0)  # coefficient [-]
    strength: float = number(default=1.0)  # [-]
    margin: float = number(default=1.0)  # [least spacings]; infinite to search at every step

    def __attrs_post_init__(self) -> None:
        check_positive("contact", "strength", self.strength, "1 / spacings that it yields, near 1")
        if not 0.0 <= self.friction < 100.0:
            raise SceneError(
                f"contact: friction must lie between 0 and 100, got {self.friction}; it is "
                "Coulomb's coefficient"
            )
        if not self.margin >= 0.0:
            raise SceneError(
                f"contact: margin must not be negative, got {self.margin}; it is in spacings, "
                "and 1 is usual"
            )
        object.__setattr__(self, "itself", _names("itself", self.itself))
        if self.between is not None:
            if isinstance(self.between, str) or not isinstance(self.between, Sequence):
                raise SceneError(_not_pairs(self.between))
            pairs = tuple(_names("between", pair) for pair in self.between)
            if any(len(pair) != 2 or pair[0] == pair[1] for pair in pairs):
                raise SceneError(_not_pairs(self.between))
            object.__setattr__(self, "between", pairs)

    def bind(self, model: DiscreteModel, label: str) -> Load:
        pairs = self._pairs_of_bodies(model.bodies)
        meetings = [meeting_of(one, other, self.strength, self.margin) for one, other in pairs]
        return _Contact(
            label=label,
            particles=np.unique(np.concatenate([meeting.particles for meeting in meetings])),
            reference=model.particles.positions,
            meetings=meetings,
            friction=self.friction,
            dimension=model.particles.dimension,
            stiffness_rate=max(meeting.frequency for meeting in meetings),
        )

    def pair_work(self, particles: float, pairs: float) -> float:
        # While bodies are apart only boxes are compared; touching surfaces have few pairs.
        return particles

    def _pairs_of_bodies(self, bodies: Sequence[Body]) -> Sequence[tuple[Body, Body]]:
        """Pairs of bodies; a body that may touch itself is paired with itself."""
        known = {body.name: body for body in bodies}
        for name in {*(n for pair in self.between or () for n in pair), *self.itself} - {"all"}:
            if name not in known:
                raise SceneError(
                    f"contact: there is no body {name!r}; bodies: {', '.join(map(repr, known))}"
                )
        pairs = combinations(known, 2) if self.between is None else self.between
        alone = known if "all" in self.itself else self.itself
        found = [(known[a], known[b]) for a, b in (*pairs, *((one, one) for one in alone))]
        if not found:
            raise SceneError(
                "contact: there is one body, and nothing that it could touch; add a body, or let "
                f"it touch itself: itself = [{next(iter(known))!r}]"
            )
        return found


@final
@attrs.frozen(eq=False)
class _Contact(EnergyTerm, FieldTerm, Load):
    rate_independent: ClassVar[bool] = True

    label: str
    particles: Indices  # (k,)
    reference: Array  # X of all particles, (n, d) [m]
    meetings: Sequence[Meeting]
    friction: float
    dimension: int
    stiffness_rate: float  # [rad/s]
    places: slice | Indices = attrs.field(init=False, repr=False)  # the particles

    @places.default
    def _as_a_slice(self) -> slice | Indices:
        return together(self.particles)

    @property
    def arrays(self) -> Mapping[str, int]:
        sizes: dict[str, int] = {}
        for meeting in self.meetings:
            count = len(meeting.particles)
            sizes[f"sites of {meeting.name}"] = 41 * count
            if self.friction:
                sizes[f"slip of {meeting.name}"] = 8 * self.dimension * count
        return sizes

    @property
    def pair_count(self) -> int:
        # As in `Contact.pair_work`.
        return len(self.particles)

    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        """Normal forces; friction depends on memory."""
        forces = np.zeros_like(positions)
        for meeting in self.meetings:
            touch = meeting.touch(positions)
            if touch is not None:
                forces[meeting.places] += meeting.normal_forces(touch)
        return np.asarray(forces[self.places])

    def advance(
        self, time: float, step: float, positions: Array, velocities: Array, memory: Memory
    ) -> tuple[Array, Memory]:
        forces: Array | None = None
        slips: dict[str, Array] = {}
        asleep = 0
        for meeting in self.meetings:
            touch = meeting.touch(positions)
            asleep += touch is None
            force, slip = self._contact_force(meeting, touch, positions, velocities, step, memory)
            slips |= slip
            if force is None:
                continue
            if forces is None:
                forces = np.zeros_like(positions)
            forces[meeting.places] += force
        before = memory.get(self._asleep, np.zeros(1))
        count = before + asleep if step > 0.0 else before
        none = (len(self.particles), positions.shape[1])
        found = np.zeros(none) if forces is None else forces[self.places]
        return found, {self._asleep: count, **slips}

    def stiffness(self, displacements: Array, time: float) -> csr_array | None:
        """Minus the derivative of the normal forces, (d n, d n) [N/m]; None while all are apart."""
        return self.stiffness_of_step(time, 0.0, displacements, np.zeros_like(displacements), {})

    def stiffness_of_step(
        self, time: float, step: float, displacements: Array, velocities: Array, memory: Memory
    ) -> csr_array | None:
        """That of the normal forces and of friction, (d n, d n) [N/m]; None while all are apart."""
        x = self.reference + displacements
        total: csr_array | None = None
        for meeting in self.meetings:
            touch = meeting.touch(x)
            if touch is None or not touch.excess.any():
                continue
            own = normal_stiffness(meeting, touch)
            if self._has_friction(meeting):
                slip, places = self._slip(meeting, memory), meeting.places
                of_meeting = meeting, touch, x[places], velocities[places], slip, step
                held = friction_stiffness(*of_meeting, self.friction)
                own = own if held is None else csr_array(own + held)
            of_all = spread(own, meeting.particles, len(x))
            total = of_all if total is None else csr_array(total + of_all)
        return total

    def _contact_force(
        self,
        meeting: Meeting,
        touch: Touch | None,
        positions: Array,
        velocities: Array,
        step: float,
        memory: Memory,
    ) -> tuple[Array | None, Mapping[str, Array]]:
        """Force on the particles of a meeting, (m, d) [N] or None, and the new stretches."""
        if not self._has_friction(meeting):
            return None if touch is None else meeting.normal_forces(touch), {}
        slip = self._slip(meeting, memory)
        if touch is None:
            return None, {self._slip_name(meeting): np.zeros_like(slip)}
        x, v = positions[meeting.places], velocities[meeting.places]
        rubbed, slipped = meeting.rubbed(touch, x, v, slip, step, self.friction)
        return meeting.normal_forces(touch) + rubbed, {self._slip_name(meeting): slipped}

    def energies(self, observation: Observation) -> Array:
        """Energy of compression and of the tangential springs, (n,) [J]."""
        state = observation.state
        energies = np.zeros(len(state.positions))
        for meeting in self.meetings:
            touch = meeting.touch(state.positions)
            if touch is None:
                continue
            energies[meeting.particles] += meeting.energies(touch)
            if self._has_friction(meeting):
                slip = self._slip(meeting, state.memory)
                held = 0.5 * meeting.spring * np.sum(slip**2, axis=1)
                energies[meeting.particles] += held
        return energies

    def report(self, observation: Observation) -> Mapping[str, float]:
        state, label = observation.state, self.label
        positions = state.positions
        columns = {f"{label} energy [J]": float(self.energies(observation).sum())}
        pairs, gaps = 0, []
        for meeting in self.meetings:
            touch = meeting.touch(positions)
            force = np.zeros(positions.shape[1])
            if touch is not None:
                excess, near = touch.excess, touch.near
                pairs += int(np.sum((excess[near.i] > 0.0) | (excess[near.j] > 0.0)))
                # A step of length 0 leaves the springs as they are: the forces that acted.
                acted, _ = self._contact_force(
                    meeting, touch, positions, state.velocities, 0.0, state.memory
                )
                force -= 0.0 if acted is None else acted[meeting.belongs].sum(axis=0)
            if meeting.first == meeting.second:
                continue
            gaps.append(meeting.least_gap(positions))
            for name, value in zip(_NAMES, force, strict=False):
                column = f"{label} force of {meeting.first} on {meeting.second} {name} [N]"
                columns[column] = float(value)
        asleep = observation.state.memory.get(self._asleep, np.zeros(1))
        return {
            **columns,
            **({f"{label} least gap [m]": min(gaps)} if gaps else {}),
            f"{label} touching pairs [-]": float(pairs),
            f"{label} evaluations asleep [-]": float(asleep[0]),
        }

    def fields(self, observation: Observation) -> Mapping[str, Array]:
        return {f"{self.label} force [N]": observation.state.applied[self.label]}

    def _has_friction(self, meeting: Meeting) -> bool:
        # There is no sliding in 1D.
        return self.friction > 0.0 and meeting.kernel.dimension > 1

    def _slip(self, meeting: Meeting, memory: Memory) -> Array:
        none = (len(meeting.particles), meeting.kernel.dimension)
        return memory.get(self._slip_name(meeting), np.zeros(none))

    def _slip_name(self, meeting: Meeting) -> str:
        return f"{self.label} slip of {meeting.name}"

    @property
    def _asleep(self) -> str:
        return f"{self.label} evaluations asleep"


def _names(field: str, given: Sequence[str]) -> tuple[str, ...]:
    if isinstance(given, str) or not all(isinstance(name, str) for name in given):
        raise SceneError(f"contact: {field} must be a list of names of bodies, got {given!r}")
    return tuple(given)


def _not_pairs(given: object) -> str:
    return (
        'contact: between must be a list of pairs of different bodies such as [["ball", "plate"]], '
        f"got {given!r}"
    )
