"""First use: cheap properties of parts that are not our own, asked once before a scene runs.

The conformance kits ask all there is to ask, and take seconds; these take milliseconds.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from solidsph.conformance.kits import KITS
from solidsph.errors import BuildError, PartWarning
from solidsph.interfaces.terms import EnergyTerm, Load
from solidsph.model.particles import read_only
from solidsph.registry.origin import described
from solidsph.registry.registry import entry_of, singular
from solidsph.run.built_scene import BuiltScene
from solidsph.scene import returned_values

# Of a kit, by the names of its checks: those that need no scene of their own.
_QUICK: Mapping[str, Sequence[str]] = {
    "kernels": ("slope", "not_negative", "falling", "smooth_centre"),
    "materials": ("stress", "tangent", "natural_state", "wave_speed", "virgin_state"),
    "divergences": ("momentum", "adjoint"),
    "gradients": ("exact_degree",),
    "integrators": ("bookkeeping", "imposed_motion"),
}

# Of a change of energy. Differences over a thousandth of the displacement err by its square, 1e-6,
# and by as much where a thousandth of the particles comes to touch something within them.
_DIFFERENT = 1e-3

_MOVED = 1e-2  # displacements at which energies are compared, in spacings
_SMALL = 1e-5  # differences, in spacings: far less, so that a force may be of any power of them

_OF_STEP = 0.02  # of the highest frequency that the step bears

_asked: dict[tuple[str, type, str], tuple[str, ...]] = {}
"""By kind, class and part: what was found in this process. A class that is defined anew, as one
does in a notebook, is another class."""


def ask(simulation: BuiltScene, parts: Sequence[tuple[str, Any]]) -> None:
    """Warn of every promise that one of `parts`, kind and part, is seen not to keep.

    Raises:
        BuildError: what a part hands back cannot be used at all.
    """
    with np.errstate(all="ignore"):  # as in steps
        found = _found(simulation, parts)
    for one in found:
        warnings.warn(one, PartWarning, stacklevel=2)


def _found(simulation: BuiltScene, parts: Sequence[tuple[str, Any]]) -> list[str]:
    _check_forces(simulation, parts)
    found: list[str] = []
    for kind, part in parts:
        key = kind, type(part), repr(part)
        if key not in _asked:
            _asked[key] = tuple(_quick(kind, part))
        found += _asked[key]
    foreign = [part for kind, part in parts if kind == "effects"]
    for label, effect in simulation.effects.items():
        if any(effect is one for one in foreign):
            found += _of_effect(simulation, label, effect)
    return found


def _quick(kind: str, part: Any) -> Iterator[str]:
    if kind not in _QUICK:
        return
    results = [one(part) for one in KITS[kind] if one.__name__ in _QUICK[kind]]
    failed = [one for one in results if not one.passed]
    if failed:
        measured = "; ".join(f"{one.name}: {one.measured}" for one in failed)
        yield _told(kind, part, measured, "; ".join(one.required for one in failed))


def _told(kind: str, part: Any, measured: str, required: str) -> str:
    who = described(entry_of(kind, part))
    return (
        f"{who} does not keep a promise of its interface: {measured}. Required: {required}. The "
        f"result is in doubt; correct the {singular(kind)} (solidsph check tests all of it)"
    )


def _of_effect(simulation: BuiltScene, label: str, effect: Any) -> Iterator[str]:
    """Its energy, and the rates that it declares, along one random motion of this scene."""
    condition = simulation.load_of(label)
    particles, masses = simulation.particles, simulation.dynamics.masses
    rng = np.random.default_rng(0)
    state = simulation.initial
    X, real = state.positions, ~particles.ghosts[:, None]
    moved, du = (
        np.where(real, rng.normal(size=X.shape), 0.0) * particles.spacings.min() for _ in "ud"
    )
    still, memory = np.zeros_like(X), state.memory

    def force(u: Any, v: Any, time: float = 0.0) -> Any:
        out = np.zeros_like(X)
        out[condition.particles] = condition.advance(time, 0.0, X + u, v, memory)[0]
        return out

    wrong: list[str] = []
    if isinstance(condition, EnergyTerm):
        end = simulation.steps * simulation.step_size
        for time in (0.0, end):
            wrong += _of_energy(simulation, condition, effect, force, time, _MOVED * moved, du)
            if wrong:
                break
    h = _SMALL
    norm = float(np.sum(masses[:, None] * du**2))
    for name, declared, change in (
        (
            "stiffness_rate",
            condition.stiffness_rate**2,
            (force(-h * du, still) - force(h * du, still)) / (2.0 * h),
        ),
        (
            "damping_rate",
            condition.damping_rate,
            (force(still, -h * du) - force(still, h * du)) / (2.0 * h),
        ),
    ):
        # A mean over frequencies squared, or rates: the largest is no smaller.
        found = float(np.sum(du * change)) / norm
        power = 0.5 if name == "stiffness_rate" else 1.0
        # What is small beside the fastest motion of the step makes no difference to it.
        unnoticed = (_OF_STEP * 2.0 / simulation.step_size) ** (1.0 / power)
        if found > 1.01 * declared + unnoticed:
            wrong.append(
                f"{name} is {declared**power:.4g} 1/s, and a motion has {found**power:.4g} 1/s at "
                "least by the effect alone"
            )
    if wrong:
        required = "what it stores is minus its work, and no motion is faster than it declares"
        yield _told("effects", effect, f"label {label!r}: {'; '.join(wrong)}", required)


def _of_energy(
    simulation: BuiltScene,
    condition: Any,
    effect: Any,
    force: Callable[[Any, Any, float], Any],
    time: float,
    u: Any,
    du: Any,
) -> Iterator[str]:
    import attrs

    X, d = simulation.initial.positions, _SMALL * du

    def energies(u: Any) -> Any:
        state = attrs.evolve(simulation.initial, time=time, positions=X + u)
        return condition.energies(simulation.dynamics.observe(state))

    def stored(u: Any) -> float:
        return float(np.sum(energies(u)))

    if np.shape(energies(u)) != (len(X),):
        raise BuildError(
            [
                f"{described(entry_of('effects', effect))}, label {condition.label!r}: `energies` "
                f"have the shape {np.shape(energies(u))}; {(len(X),)} is expected"
            ]
        )
    f = force(u, np.zeros_like(X), time)
    change, work = stored(u + d) - stored(u - d), 2.0 * float(np.vdot(f, d))
    scale = 2.0 * float(np.abs(f * d).sum())
    if abs(change + work) > _DIFFERENT * scale:
        yield (
            f"what it stores changes by {change:.4g} J along a motion in which its force does "
            f"{work:.4g} J of work"
        )


def _check_forces(simulation: BuiltScene, parts: Sequence[tuple[str, Any]]) -> None:
    """That forces of foreign parts have their shape: others may fit by broadcasting."""
    modules = {type(part).__module__ for kind, part in parts if kind in ("effects", "boundaries")}
    wrong = force_problems(simulation, modules)
    if wrong:
        raise BuildError(wrong)


def force_problems(simulation: BuiltScene, modules: set[str]) -> list[str]:
    """What is wrong with the forces of conditions whose classes are of `modules`."""
    # One that writes to what it is given is told so here, before it changes a motion.
    state, d = read_only(simulation.initial), simulation.particles.dimension
    found = []
    for load in simulation.dynamics.loads:
        if type(load).__module__ in modules and isinstance(load, Load):
            x, v, h = state.positions, state.velocities, simulation.step_size
            f, kept = load.advance(0.0, 0.0, x, v, state.memory)
            wrong = returned_values.force(load, f, d) or returned_values.kept(load, kept)
            if not wrong:
                f, kept = load.advance(h, h, x, v, {**state.memory, **kept})
                wrong = returned_values.force(load, f, d) or returned_values.kept(load, kept)
            found.append(wrong)
    return [one for one in found if one]
