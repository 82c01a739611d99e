"""Checks of bound terms: their forces, fields, reports and energy accounts."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np

from solidsph.conformance.check import Broken, NotPromised, Verdict
from solidsph.conformance.derived import overridden
from solidsph.interfaces.terms import FieldTerm, Load, Observation, Term
from solidsph.maths.arrays import Array, Mask
from solidsph.run.energy import kinetic_energy, ledger, strain_energy
from solidsph.simulation import Simulation
from solidsph.statics.stiff import is_stiff


def observed(simulation: Simulation) -> Iterator[Observation]:
    """The start and the states at the outputs, step by step."""
    state = simulation.start()
    yield simulation.dynamics.observe(state)
    loop = simulation.time_loop()
    for stop in simulation.output_steps():
        state = loop.advance(state, stop)
        yield simulation.dynamics.observe(state)


def residual(simulation: Simulation) -> float:
    """Residual of the energy ledger at the end of a run, over the most energy that moved in it."""
    first, *others = list(observed(simulation))
    start = kinetic_energy(first) + strain_energy(first)
    accounts = [ledger(observation, start) for observation in others]
    moved = max(start, *(max(map(abs, account.values())) for account in accounts))
    return max(abs(account["energy residual [J]"]) for account in accounts) / moved


def force_problem(simulation: Simulation, load: Load, u: Array) -> str:
    """What is wrong with the forces of a load at displacements `u` (n, d); "" if nothing is."""
    particles = simulation.particles
    x, v = simulation.initial.positions + u, 1e2 * u[::-1]
    chosen = np.asarray(load.particles)
    before = x.copy(), v.copy()
    f = load.forces(1e-3, x, v)
    # At another time in between: a part that remembers when it was asked last would show.
    load.forces(2e-3, x, v)
    again = load.forces(1e-3, x, v)
    ghosts: Mask = particles.ghosts[chosen]
    shape = len(chosen), particles.dimension
    same = np.array_equal(before[0], x) and np.array_equal(before[1], v)
    problems = {
        f"forces {np.shape(f)} for {len(chosen)} particles": f.shape != shape,
        "a force is not finite": not np.all(np.isfinite(f)),
        "a particle is named twice": len(np.unique(chosen)) != len(chosen),
        "a ghost is pushed": bool(ghosts.any() and np.any(f[ghosts] != 0.0)),
        "positions or velocities were changed": not same,
        "the same state and time gave other forces": not np.array_equal(f, again),
    }
    return "; ".join(problem for problem, present in problems.items() if present)


def stiffness_error(simulation: Simulation, load: Load, u: Array, du: Array) -> float | None:
    """By how much the stiffness of a load misses minus the derivative of its force along `du`, over
    the larger of both, at displacements `u` (n, d); None if it declares none."""
    told: object = load
    if not is_stiff(told):
        return None
    time, still = 1e-3, np.zeros_like(u)
    X, step = simulation.particles.positions, 1e-4
    change = np.zeros_like(u)
    for sign in (-1.0, 1.0):
        change[load.particles] += sign * load.forces(time, X + u + sign * step * du, still)
    measured = -0.5 * change / step
    stiffness = told.stiffness(u, time)
    declared = np.zeros_like(u) if stiffness is None else (stiffness @ du.ravel()).reshape(u.shape)
    size = max(float(np.abs(measured).max()), float(np.abs(declared).max()))
    return float(np.abs(declared - measured).max()) / size if size > 0.0 else 0.0


def field_verdict(simulation: Simulation, terms: Sequence[Term]) -> Verdict:
    """Whether a record can hold the fields of `terms`; lists them."""
    shown = [term for term in terms if isinstance(term, FieldTerm)]
    if not shown:
        raise NotPromised("it shows no field")
    n, d = simulation.particles.positions.shape
    names: list[set[str]] = []
    for observation in observed(simulation):
        fields = {name: a for term in shown for name, a in term.fields(observation).items()}
        for name, values in fields.items():
            if not _has_unit(name):
                raise Broken(f"field {name!r}")
            if np.shape(values) not in ((n,), (n, d), (n, d, d)) or not np.all(np.isfinite(values)):
                raise Broken(f"{name} {np.shape(values)} of {n} particles, or not finite")
        names.append(set(fields))
    if any(others != names[0] for others in names):
        raise Broken(f"{sorted(names[0])}, then others")
    return Verdict(True, ", ".join(sorted(names[0])) or "none")


def check_report(label: str, report: Mapping[str, float]) -> None:
    """Raise Broken unless a report has finite numbers in columns "label quantity [unit]"."""
    for name, value in report.items():
        if not (name.startswith(f"{label} ") and _has_unit(name)):
            raise Broken(f"column {name!r}")
        if not np.isfinite(value):
            raise Broken(f"{name} = {value}")


def derived_verdict(terms: Iterable[Term]) -> Verdict:
    """Whether `terms` leave alone what their kinds derive."""
    problem = next(filter(None, map(overridden, terms)), "")
    return Verdict(not problem, problem or "nothing is overridden")


def _has_unit(name: str) -> bool:
    return name.endswith("]") and " [" in name
