"""Quick checks of third-party parts when a scene first uses them.

The conformance kits check everything and take seconds; these checks take milliseconds.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import attrs
import numpy as np

from solidsph.conformance.kits import KITS
from solidsph.errors import BuildError, PartWarning
from solidsph.interfaces.terms import EnergyTerm, Load
from solidsph.model.particles import read_only
from solidsph.registry.origin import described
from solidsph.registry.registry import entry_of, singular
from solidsph.run.built_scene import BuiltScene
from solidsph.scene.checks.returned import check_advanced

# Names of the checks of each kit that need no scene of their own.
_QUICK: Mapping[str, Sequence[str]] = {
    "kernels": ("slope", "not_negative", "falling", "smooth_centre"),
    "materials": ("stress", "tangent", "natural_state", "wave_speed", "virgin_state"),
    "divergences": ("momentum", "adjoint"),
    "gradients": ("exact_degree",),
    "integrators": ("bookkeeping", "imposed_motion"),
}

# Tolerance for changes of energy. Differences over a thousandth of the displacement have an error
# of its square, 1e-6, and as much again where a thousandth of the particles come into contact.
_DIFFERENT = 1e-3

_MOVED = 1e-2  # displacements at which energies are compared [spacings]
_SMALL = 1e-5  # differences [spacings], far smaller, so that a force may be of any power of them

_OF_STEP = 0.02  # fraction of the highest frequency that the step resolves

_checked: dict[tuple[str, type, str], tuple[str, ...]] = {}
"""Problems found in this process, by kind, class and part. A class that is defined again, as in a
notebook, is another class."""


def check_first_use(simulation: BuiltScene, parts: Sequence[tuple[str, Any]]) -> None:
    """Warn of every promise that a part does not keep; `parts` are pairs of kind and part.

    Raises:
        BuildError: a part returned something unusable.
    """
    with np.errstate(all="ignore"):  # as in steps
        problems = _problems(simulation, parts)
    for problem in problems:
        warnings.warn(problem, PartWarning, stacklevel=2)


def _problems(simulation: BuiltScene, parts: Sequence[tuple[str, Any]]) -> list[str]:
    # Wrong shapes must not pass by broadcasting.
    modules = {type(part).__module__ for kind, part in parts if kind in ("effects", "boundaries")}
    wrong = _force_problems(simulation, modules)
    if wrong:
        raise BuildError(wrong)
    problems: list[str] = []
    for kind, part in parts:
        key = kind, type(part), repr(part)
        if key not in _checked:
            _checked[key] = tuple(_kit_problems(kind, part))
        problems += _checked[key]
    foreign = [part for kind, part in parts if kind == "effects"]
    for label, effect in simulation.effects.items():
        if any(effect is part for part in foreign):
            problems += _effect_problems(simulation, label, effect)
    return problems


def _force_problems(simulation: BuiltScene, modules: set[str]) -> list[str]:
    """Problems of the forces of loads whose classes are of `modules`."""
    # Read-only, so that a load that writes to its arguments fails here and not in the motion.
    state, d = read_only(simulation.initial), simulation.particles.dimension
    problems = []
    for load in simulation.dynamics.loads:
        if type(load).__module__ in modules and isinstance(load, Load):
            x, v, h = state.positions, state.velocities, simulation.step_size
            first = load.advance(0.0, 0.0, x, v, state.memory)
            problem = check_advanced(load, first, d)
            if not problem:
                second = load.advance(h, h, x, v, {**state.memory, **first[1]})
                problem = check_advanced(load, second, d)
            problems.append(problem)
    return [problem for problem in problems if problem]


def _kit_problems(kind: str, part: Any) -> Iterator[str]:
    if kind not in _QUICK:
        return
    results = [check(part) for check in KITS[kind] if check.__name__ in _QUICK[kind]]
    failed = [result for result in results if not result.passed]
    if failed:
        measured = "; ".join(f"{result.name}: {result.measured}" for result in failed)
        yield _message(kind, part, measured, "; ".join(result.required for result in failed))


def _message(kind: str, part: Any, measured: str, required: str) -> str:
    who = described(entry_of(kind, part))
    return (
        f"{who} does not keep a promise of its interface: {measured}. Required: {required}. The "
        f"results may be wrong; correct the {singular(kind)} (solidsph check tests it fully)"
    )


def _effect_problems(simulation: BuiltScene, label: str, effect: Any) -> Iterator[str]:
    """Check the energy and the declared rates of an effect along a random motion of the scene."""
    load = simulation.load_of(label)
    particles, masses = simulation.particles, simulation.dynamics.masses
    rng = np.random.default_rng(0)
    state = simulation.initial
    X, real = state.positions, ~particles.ghosts[:, None]
    moved, du = (
        np.where(real, rng.normal(size=X.shape), 0.0) * particles.spacings.min() for _ in "ud"
    )
    rest, memory = np.zeros_like(X), state.memory

    def force(u: Any, v: Any, time: float = 0.0) -> Any:
        out = np.zeros_like(X)
        out[load.particles] = load.advance(time, 0.0, X + u, v, memory)[0]
        return out

    wrong: list[str] = []
    if isinstance(load, EnergyTerm):
        end = simulation.steps * simulation.step_size
        for time in (0.0, end):
            wrong += _energy_problems(simulation, load, effect, force, time, _MOVED * moved, du)
            if wrong:
                break
    h = _SMALL
    norm = float(np.sum(masses[:, None] * du**2))
    stiffness = (force(-h * du, rest) - force(h * du, rest)) / (2.0 * h)
    damping = (force(rest, -h * du) - force(rest, h * du)) / (2.0 * h)
    for name, declared, power, change in (
        ("stiffness_rate", load.stiffness_rate**2, 0.5, stiffness),
        ("damping_rate", load.damping_rate, 1.0, damping),
    ):
        # A mean over squared frequencies, or rates: the largest is no smaller.
        mean = float(np.sum(du * change)) / norm
        # A rate far below the fastest motion of the step does not matter.
        negligible = (_OF_STEP * 2.0 / simulation.step_size) ** (1.0 / power)
        if mean > 1.01 * declared + negligible:
            wrong.append(
                f"{name} is {declared**power:.4g} 1/s, but the effect alone gives a motion at "
                f"least {mean**power:.4g} 1/s"
            )
    if wrong:
        required = "the stored energy is minus the work, and no motion is faster than declared"
        yield _message("effects", effect, f"label {label!r}: {'; '.join(wrong)}", required)


def _energy_problems(
    simulation: BuiltScene,
    load: Any,
    effect: Any,
    force: Callable[[Any, Any, float], Any],
    time: float,
    u: Any,
    du: Any,
) -> Iterator[str]:
    X, d = simulation.initial.positions, _SMALL * du

    def energies(u: Any) -> Any:
        state = attrs.evolve(simulation.initial, time=time, positions=X + u)
        return load.energies(simulation.dynamics.observe(state))

    if np.shape(energies(u)) != (len(X),):
        raise BuildError(
            [
                f"{described(entry_of('effects', effect))}, label {load.label!r}: `energies` "
                f"have the shape {np.shape(energies(u))}; {(len(X),)} is expected"
            ]
        )
    f = force(u, np.zeros_like(X), time)
    change = float(np.sum(energies(u + d))) - float(np.sum(energies(u - d)))
    work = 2.0 * float(np.vdot(f, d))
    scale = 2.0 * float(np.abs(f * d).sum())
    if abs(change + work) > _DIFFERENT * scale:
        yield (
            f"the stored energy changes by {change:.4g} J along a motion in which the force does "
            f"{work:.4g} J of work"
        )
