"""Heat conduction and thermal expansion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from math import ceil, sqrt
from typing import TYPE_CHECKING, Any, ClassVar, final

import attrs
import numpy as np
from scipy.sparse import block_diag, csr_array, diags_array

from solidsph.errors import SceneError
from solidsph.interfaces.body import Body
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.effect import Effect, Need
from solidsph.interfaces.history import HistoryMaterial
from solidsph.interfaces.material import Material
from solidsph.interfaces.memory import Memory
from solidsph.interfaces.terms import FieldTerm, Load, Observation
from solidsph.maths.arrays import Array, Indices, Tensor
from solidsph.maths.tensors import particles_first
from solidsph.model.fields import Component, VectorField
from solidsph.model.regions import Where
from solidsph.registry.parameters import check_positive, formula, number
from solidsph.run.cfl_step import lattice_frequency
from solidsph_builtin.effects._gradients import BodyGradient, in_the_reference, real_pairs

if TYPE_CHECKING:
    from solidsph_builtin.effects._heat_flow import HeatFlow

# Entries of K from which a compiled pass pays, which takes a tenth of the time of the product.
_MANY = 100_000

# Step of the explicit rule for the temperature, relative to its largest stable step.
_PART = 0.9


def _places(given: Any) -> tuple[tuple[Where, Component], ...]:
    """(where, temperature) of all held places, from the value in a scene."""
    wanted = 'heat: held takes a list such as [{where = "left", temperature = 100}]'
    if isinstance(given, (str, Mapping)) or not isinstance(given, Sequence):
        raise SceneError(f"{wanted}, got {given!r}")
    for entry in given:
        if isinstance(entry, tuple) and len(entry) == 2:
            continue
        if not isinstance(entry, Mapping) or set(entry) != {"where", "temperature"}:
            raise SceneError(f"{wanted}, got the entry {entry!r}")
    return tuple(
        (entry["where"], entry["temperature"]) if isinstance(entry, Mapping) else entry
        for entry in given
    )


@final
@attrs.frozen
class Heat(Effect):
    """rho c dT/dt = div(k Grad T) + source, and free stretches of 1 + expansion T.

    T is the difference from the temperature of the reference configuration. Surfaces are insulated
    where T is not held. Between two particles heat flows at the rate
    2 k V_a V_b |W'| / R (T_b - T_a), Cleary & Monaghan (1999), in the reference configuration and
    scaled so that a full neighbourhood has exactly the given conductivity; heat is conserved.

    With the stretch g = 1 + expansion T the material has the energy g^3 psi(F / g), also out of the
    plane: free swelling is free of stress, and the stress of restrained swelling follows from the
    law at any strain. The account holds the work of swelling on the motion. Heating by deformation
    is neglected.
    """

    conserves_momentum: ClassVar[bool] = True
    # Between particles on a surface and those inside, whose volumes differ, it flows as through 1.7
    # spacings more.
    at_cell_centres: ClassVar[bool] = True
    answers: ClassVar[frozenset[Need] | None] = frozenset()
    uses_initial_pairs: ClassVar[bool] = True

    conductivity: float = number()  # k [W/(m K)]
    heat_capacity: float = number()  # c per mass [J/(kg K)]
    expansion: float = number(default=0.0)  # linear [1/K]
    initial: Component = formula(default=0.0)  # T at the start, of X, Y, Z [K]
    source: Component = formula(default=0.0)  # of X, Y, Z and t [W/m^3]
    held: Sequence[Any] = attrs.field(default=(), converter=_places)
    largest: float = number(default=1000.0)  # largest |T| for which the time step is stable [K]

    example: ClassVar[Mapping[str, Any]] = {
        "conductivity": 50.0,
        "heat_capacity": 500.0,
        "expansion": 1e-4,
        "initial": "100*sin(4*X)",
    }

    def __attrs_post_init__(self) -> None:
        check_positive("heat", "conductivity", self.conductivity, "W/(m K)")
        check_positive("heat", "heat_capacity", self.heat_capacity, "J/(kg K)")
        check_positive("heat", "largest", self.largest, "K")
        if not abs(self.expansion) * self.largest < 0.5:
            raise SceneError(
                f"heat: expansion times largest must stay below 0.5, got {self.expansion:g} 1/K "
                f"times {self.largest:g} K; metals have some 1e-5 1/K"
            )

    def bind(self, model: DiscreteModel, label: str) -> Load:
        in_the_reference(model, "heat")
        for body in model.bodies:
            if self.expansion and isinstance(body.material, HistoryMaterial):
                raise SceneError(
                    f"heat: the swelling of body {body.name!r} needs a material that is a formula "
                    f"of F, and {type(body.material).__name__} has a history; set expansion = 0, "
                    "or take another material"
                )
        X = model.particles.positions
        held = [
            (
                model.select(where),
                VectorField.of({"x": value}, "heat: held.temperature", end=model.end),
            )
            for where, value in self.held
        ]
        start = VectorField.of({"x": self.initial}, "heat: initial")
        start.check_without("t", "the temperature at the start is asked once, at t = 0")
        return _Conduction(
            label=label,
            reference=X,
            conduction=_conduction(model.bodies, self.conductivity),
            capacities=self.heat_capacity * model.masses,
            volumes=np.where(model.particles.ghosts, 0.0, model.particles.volumes),
            expansion=self.expansion,
            start=start.values(0, X, 0.0),
            source=VectorField.of({"x": self.source}, "heat: source", end=model.end),
            held=held,
            gradients=[BodyGradient.of(b) for b in model.bodies] if self.expansion else [],
            # A swollen body is stiffer by about three times its stretch.
            stiffness_rate=sqrt(3.0 * abs(self.expansion) * self.largest)
            * lattice_frequency(model.bodies),
        )

    def pair_work(self, particles: float, pairs: float) -> float:
        return 3.0 * pairs if self.expansion else pairs


def _conduction(bodies: Sequence[Body], conductivity: float) -> csr_array:
    """K (n, n) [W/K]: K T is the heat flow to every particle [W]."""
    count = bodies[-1].extent.stop
    rows, columns, values = [], [], []
    for body in bodies:
        pairs, particles = body.pairs(), body.particles
        acts = real_pairs(body, pairs)
        a, b, R = pairs.rows[acts], pairs.columns[acts], pairs.distances[acts]
        V, H = particles.volumes, body.smoothing.between(a, b)
        slope = np.abs(body.smoothing.slope(R, H))
        # The second moment of a full neighbourhood, of which the integral is 1.
        moments = np.bincount(a, V[b] * slope * R, particles.count) / particles.dimension
        rows.append(a + body.extent.start)
        columns.append(b + body.extent.start)
        values.append(2.0 * conductivity * V[a] * V[b] * slope / (R * moments.max()))
    flat = tuple(np.concatenate(ends) for ends in (rows, columns))
    K = csr_array((np.concatenate(values), flat), shape=(count, count))
    return csr_array(K - diags_array(np.asarray(K.sum(axis=1)), format="csr"))


@final
@attrs.frozen(eq=False)
class _Conduction(FieldTerm, Load):
    label: str
    reference: Array  # X (n, d)
    conduction: csr_array  # K (n, n) [W/K]
    capacities: Array  # (n,) [J/K]
    volumes: Array  # (n,)
    expansion: float
    start: Array  # T (n,) [K]
    source: VectorField
    held: Sequence[tuple[Indices, VectorField]]
    gradients: Sequence[BodyGradient]  # of every body, where they swell
    stiffness_rate: float  # [rad/s]

    @property
    def arrays(self) -> Mapping[str, int]:
        K, n = self.conduction, len(self.capacities)
        return {
            "conduction": K.data.nbytes + K.indices.nbytes + K.indptr.nbytes,
            "temperature": 8 * n,
            "capacities": 8 * n,
            **{f"gradient of {g.body.name}": g.matrices.bytes for g in self.gradients},
        }

    @property
    def pair_count(self) -> int:
        return self.conduction.nnz + 2 * sum(gradient.pair_count for gradient in self.gradients)

    @property
    def particles(self) -> Indices:
        return np.arange(len(self.reference))

    @property
    def _name(self) -> str:
        return f"{self.label}: temperature"

    def temperature(self, memory: Memory) -> Array:
        """T of a state with this memory, (n,) [K]."""
        return memory.get(self._name, self._holding(0.0, self.start))

    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        return self.advance(time, 0.0, positions, velocities, {})[0]

    def advance(
        self, time: float, step: float, positions: Array, velocities: Array, memory: Memory
    ) -> tuple[Array, Memory]:
        T = self.temperature(memory)
        if step > 0.0:
            T = self._conducted(T, time, step)
        return self._forces(positions, T), {self._name: T}

    def _conducted(self, T: Array, time: float, step: float) -> Array:
        """T after a step that ends at `time`, in as many parts as stability requires."""
        parts = max(1, ceil(step * self._fastest / (2.0 * _PART)))
        part = step / parts
        for k in range(parts):
            now = time - step + k * part
            source = self.source.values(0, self.reference, now) * self.volumes
            T = T + part * self._inverse * (self._flow @ T + source)
            T = self._holding(now + part, T)
        return T

    @cached_property
    def _flow(self) -> csr_array | HeatFlow:
        """What gives K T."""
        if self.conduction.nnz < _MANY:
            return self.conduction
        # Loads the compiler.
        from solidsph_builtin.effects._heat_flow import HeatFlow

        return HeatFlow.of(self.conduction)

    @cached_property
    def _inverse(self) -> Array:
        """One over the capacities, (n,) [K/J]; 0 of ghosts."""
        inverse = np.zeros_like(self.capacities)
        np.divide(1.0, self.capacities, out=inverse, where=self.capacities > 0.0)
        return inverse

    @cached_property
    def _fastest(self) -> float:
        """A bound on the decay rate of temperature differences [1/s]."""
        return float(2.0 * (-self.conduction.diagonal() * self._inverse).max())

    def _holding(self, time: float, T: Array) -> Array:
        if not self.held:
            return T
        T = T.copy()
        for chosen, value in self.held:
            T[chosen] = value.values(0, self.reference[chosen], time)
        return T

    def _forces(self, positions: Array, T: Array) -> Array:
        forces = np.zeros_like(positions)
        for gradient in self.gradients:
            body = gradient.body
            H = gradient.gradient((positions - self.reference)[body.extent])
            g = 1.0 + self.expansion * T[body.extent]
            forces[body.extent] = gradient.forces(_swelling(body.material, H, g))
        return forces

    def stiffness(self, displacements: Array, time: float) -> csr_array | None:
        """Minus the derivative of the forces of swelling at the start, (d n, d n) [N/m]."""
        return self.stiffness_of_step(time, 0.0, displacements, np.zeros_like(displacements), {})

    def stiffness_of_step(
        self, time: float, step: float, displacements: Array, velocities: Array, memory: Memory
    ) -> csr_array | None:
        """Minus the derivative of the forces of swelling, (d n, d n) [N/m]."""
        if not self.gradients:
            return None
        T = self.temperature(memory)
        if step > 0.0:
            T = self._conducted(T, time, step)
        parts = []
        for gradient in self.gradients:
            body = gradient.body
            g = 1.0 + self.expansion * T[body.extent]
            H = gradient.gradient(displacements[body.extent])
            parts.append(gradient.stiffness(_swelling_moduli(body.material, H, g)))
        return csr_array(block_diag(parts, format="csr"))

    def fields(self, observation: Observation) -> Mapping[str, Array]:
        return {f"{self.label} temperature [K]": self.temperature(observation.state.memory)}

    def report(self, observation: Observation) -> Mapping[str, float]:
        T = self.temperature(observation.state.memory)
        return {
            f"{self.label} heat [J]": float(self.capacities @ T),
            f"{self.label} highest [K]": float(T.max()),
        }


def _swelling(material: Material, H: Array, g: Array) -> Array:
    """Change of the stress by a free stretch g (n,), g^2 P(F / g) - P(F), (d, d, n) [Pa]."""
    d, F = len(H), _in_space(H)
    swollen, own = (_stress(material, deformation) for deformation in (F / g, F))
    return (g**2 * swollen - own)[:d, :d]


def _swelling_moduli(material: Material, H: Array, g: Array) -> Array:
    """Derivative of that change by F, g A(F / g) - A(F), (n, d, d, d, d) [Pa]."""
    d, n, F = len(H), H.shape[2], _in_space(H)
    moduli = np.empty((n, d, d, d, d))
    for j in range(d):
        for k in range(d):
            dF = np.zeros_like(F)
            dF[j, k] = 1.0
            swollen, own = (
                particles_first(material.tangent(at, dF, material.params), n) for at in (F / g, F)
            )
            moduli[..., j, k] = (g[:, None, None] * swollen - own)[:, :d, :d]
    return moduli


def _in_space(H: Array) -> Array:
    """F = I + H in space, (3, 3, n), from H (d, d, n)."""
    d = len(H)
    F = np.repeat(np.eye(3)[:, :, None], H.shape[2], axis=2)
    F[:d, :d] += H
    return F


def _stress(material: Material, F: Array) -> Array:
    P: Tensor = material.first_piola(F, material.params)
    return np.moveaxis(particles_first(P, F.shape[2]), 0, -1)
