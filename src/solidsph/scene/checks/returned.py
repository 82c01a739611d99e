"""Checks of the values that parts return while a scene is built."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import isfinite
from typing import Any

import numpy as np

from solidsph.interfaces.integrator import Integrator
from solidsph.interfaces.material import Material
from solidsph.interfaces.terms import Constraint, Load, Term
from solidsph.model.particles import Particles
from solidsph.registry.origin import described
from solidsph.registry.registry import entry_of


def check_particles(discretisation: object, particles: Any, dimension: int) -> Iterator[str]:
    """Yield problems unless all arrays are finite and fit together, with positive volumes."""
    who = described(entry_of("discretisations", discretisation))
    if not isinstance(particles, Particles):
        yield f"{who}: `particles` returned {type(particles).__name__}; it must return Particles"
        return
    n = len(np.atleast_1d(particles.positions))
    for name, shape in (
        ("positions", (n, dimension)),
        ("volumes", (n,)),
        ("spacings", (n,)),
        ("cells", (n,)),
        ("area_vectors", (n, dimension)),
        ("images", (n, dimension)),
        ("ghosts", (n,)),
    ):
        values = getattr(particles, name)
        if np.shape(values) != shape:
            yield f"{who}: {name} have the shape {np.shape(values)}; {shape} is expected"
        elif not np.all(np.isfinite(values)):
            first = int(np.argwhere(~np.isfinite(values))[0][0])
            yield f"{who}: {name} of particle {first} are not finite; all must be finite"
    if np.shape(particles.volumes) == np.shape(particles.ghosts) == (n,):
        real = ~np.asarray(particles.ghosts, dtype=np.bool_)
        wrong = np.flatnonzero(real & ~(particles.volumes > 0.0))
        if len(wrong):
            yield (
                f"{who}: the volume of particle {wrong[0]} is {particles.volumes[wrong[0]]:g}, and "
                f"{len(wrong)} volumes in total are not positive; all but those of ghosts must be"
            )


def check_material(material: Material) -> Iterator[str]:
    """Yield problems unless density and wave speed are positive."""
    yield from _check_positive("materials", material, "density")
    yield from _check_positive("materials", material, "wave_speed")


def check_integrator(integrator: Integrator) -> Iterator[str]:
    """Yield a problem unless the stability limit is positive."""
    yield from _check_positive("integrators", integrator, "stability_limit")


def check_bound(kind: str, label: str, part: object, bound: Any) -> Iterator[str]:
    """Yield a problem unless `bind` returned a Load for an effect, or a list of Terms."""
    who = f"{described(entry_of(kind, part))}, label {label!r}"
    if kind == "effects":
        if not isinstance(bound, Load):
            yield f"{who}: `bind` returned {bound!r}; a Load is expected"
    elif not isinstance(bound, Sequence) or not all(isinstance(term, Term) for term in bound):
        yield f"{who}: `bind` returned {bound!r}; a list of Terms is expected"


def check_indices(term: Term, count: int, dimension: int) -> Iterator[str]:
    """Yield problems unless masks and indices fit the particles of the scene."""
    if isinstance(term, Constraint):
        held = np.asarray(term.held)
        if held.shape != (count, dimension) or held.dtype != np.bool_:
            yield (
                f"{term.label!r}: `held` is {held.dtype} of the shape {held.shape}; bool of the "
                f"shape {(count, dimension)} is expected"
            )
    if isinstance(term, Load):
        chosen = np.asarray(term.particles)
        if chosen.ndim != 1 or (chosen.size and chosen.dtype.kind not in "iu"):
            got = f"{chosen.dtype} {chosen.shape}"
            yield f"{term.label!r}: `particles` must be indices (k,), got {got}"
        elif chosen.size and not (chosen.min() >= 0 and chosen.max() < count):
            got = f"{chosen.min()} to {chosen.max()}"
            yield f"{term.label!r}: `particles` must lie from 0 to {count - 1}, got {got}"


def check_rates(load: Load) -> Iterator[str]:
    """Yield problems unless the rates for the stable step are not negative."""
    for name in ("damping_rate", "stiffness_rate"):
        value = getattr(load, name)
        if not _is_number(value) or value < 0.0:
            yield f"label {load.label!r}: {name} is {value!r}; a number of at least 0 is expected"


def check_advanced(load: Load, advanced: tuple[Any, Any], dimension: int) -> str:
    """Problem of what `Load.advance` returned, forces and memory; empty if there is none."""
    force, memory = advanced
    expected = (len(load.particles), dimension)
    if np.shape(force) != expected:
        return f"{load.label!r}: forces have the shape {np.shape(force)}; {expected} is expected"
    if np.asarray(force).dtype.kind not in "fiu":
        return f"{load.label!r}: forces are {np.asarray(force).dtype}; real numbers are expected"
    if not np.all(np.isfinite(force)):
        return f"{load.label!r}: a force is not finite"
    if not isinstance(memory, Mapping):
        return f"{load.label!r}: `advance` returned {memory!r}; a mapping of arrays is expected"
    for name in memory:
        # Names of different terms must not collide.
        if not isinstance(name, str) or not name.startswith(load.label):
            return (
                f"{load.label!r} stores {name!r} in the state; the name must begin with its label"
            )
    return ""


def check_report(label: str, columns: Any) -> str:
    """Problem of the columns of a report; empty if there is none."""
    if not isinstance(columns, Mapping):
        return f"{label!r}: `report` returned {columns!r}; a mapping of columns is expected"
    for name, value in columns.items():
        if not isinstance(name, str) or not _is_number(value, finite=False):
            return f"{label!r}: `report` has {name!r}: {value!r}; a number is expected"
        if not isfinite(value):
            return f"{label!r}: `report` has {name!r}: {value!r}, which is not finite"
    return ""


def _check_positive(kind: str, part: object, name: str) -> Iterator[str]:
    value: Any = getattr(part, name, None)
    if not _is_number(value) or not value > 0.0:
        who = described(entry_of(kind, part))
        yield f"{who}: {name} is {value!r}; a positive number is expected"


def _is_number(value: Any, *, finite: bool = True) -> bool:
    is_number = isinstance(value, (int, float, np.integer, np.floating))
    return is_number and not isinstance(value, bool) and (isfinite(value) or not finite)
