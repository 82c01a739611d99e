"""What parts hand back while a scene is built: each check yields problems, naming the part."""

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


def particles(discretisation: object, found: Any, dimension: int) -> Iterator[str]:
    """Particles in finite arrays of one row each, real ones with a volume."""
    who = described(entry_of("discretisations", discretisation))
    if not isinstance(found, Particles):
        yield f"{who} handed back {type(found).__name__}; `particles` must return Particles"
        return
    n = len(np.atleast_1d(found.positions))
    for name, shape in (
        ("positions", (n, dimension)),
        ("volumes", (n,)),
        ("spacings", (n,)),
        ("cells", (n,)),
        ("area_vectors", (n, dimension)),
        ("images", (n, dimension)),
        ("ghosts", (n,)),
    ):
        values = getattr(found, name)
        if np.shape(values) != shape:
            yield f"{who}: {name} have the shape {np.shape(values)}; {shape} is expected"
        elif not np.all(np.isfinite(values)):
            first = int(np.argwhere(~np.isfinite(values))[0][0])
            yield f"{who}: {name} of particle {first} are no numbers; every one must be finite"
    if np.shape(found.volumes) == np.shape(found.ghosts) == (n,):
        real = ~np.asarray(found.ghosts, dtype=np.bool_)
        wrong = np.flatnonzero(real & ~(found.volumes > 0.0))
        if len(wrong):
            yield (
                f"{who}: the volume of particle {wrong[0]} is {found.volumes[wrong[0]]:g}, and of "
                f"{len(wrong)} in all not positive; every particle that is no ghost needs one"
            )


def constants(material: Material) -> Iterator[str]:
    """A density and a wave speed that a step can be chosen by."""
    for name in ("density", "wave_speed"):
        value = getattr(material, name)
        if not _is_number(value) or not value > 0.0:
            who = described(entry_of("materials", material))
            yield f"{who}: {name} is {value!r}; a positive number is expected"


def rates(load: Load) -> Iterator[str]:
    """Rates for the stable step, each a number and none negative."""
    for name in ("damping_rate", "stiffness_rate"):
        value = getattr(load, name)
        if not _is_number(value) or value < 0.0:
            yield f"label {load.label!r}: {name} is {value!r}; a number from 0 on is expected"


def limits(integrator: Integrator) -> Iterator[str]:
    """A stability limit."""
    value = getattr(integrator, "stability_limit", None)
    if not _is_number(value) or not value > 0.0:  # type: ignore[operator]
        who = described(entry_of("integrators", integrator))
        yield f"{who}: stability_limit is {value!r}; a positive number is expected"


def conditions(kind: str, label: str, part: object, found: Any) -> Iterator[str]:
    """Bound parts: one force of an effect, conditions of a boundary handler."""
    who = f"{described(entry_of(kind, part))}, label {label!r}"
    if kind == "effects":
        if not isinstance(found, Load):
            yield f"{who}: `bind` returned {found!r}; a Load is expected"
    elif not isinstance(found, Sequence) or not all(isinstance(one, Term) for one in found):
        yield f"{who}: `bind` returned {found!r}; a list of Conditions is expected"


def shapes(found: Term, count: int, dimension: int) -> Iterator[str]:
    """Masks and indices that fit the particles of the scene."""
    if isinstance(found, Constraint):
        held = np.asarray(found.held)
        if held.shape != (count, dimension) or held.dtype != np.bool_:
            yield (
                f"{found.label!r}: `held` is {held.dtype} of the shape {held.shape}; bool of the "
                f"shape {(count, dimension)} is expected"
            )
    if isinstance(found, Load):
        chosen = np.asarray(found.particles)
        if chosen.ndim != 1 or (chosen.size and chosen.dtype.kind not in "iu"):
            told = f"{chosen.dtype} {chosen.shape}"
            yield f"{found.label!r}: `particles` must be indices (k,), got {told}"
        elif chosen.size and not (chosen.min() >= 0 and chosen.max() < count):
            told = f"{chosen.min()} to {chosen.max()}"
            yield f"{found.label!r}: `particles` must lie from 0 to {count - 1}, got {told}"


def force(found: Load, force: Any, dimension: int) -> str:
    """What is wrong with a force that was handed back; nothing if all is well."""
    expected = (len(found.particles), dimension)
    if np.shape(force) != expected:
        return f"{found.label!r}: forces have the shape {np.shape(force)}; {expected} is expected"
    if np.asarray(force).dtype.kind not in "fiu":
        return f"{found.label!r}: forces are {np.asarray(force).dtype}; real numbers are expected"
    if not np.all(np.isfinite(force)):
        return f"{found.label!r}: a force is not finite"
    return ""


def kept(found: Load, kept: Any) -> str:
    """What is wrong with what is to be remembered of a step; nothing if all is well."""
    if not isinstance(kept, Mapping):
        return f"{found.label!r}: `advance` returned {kept!r}; a mapping of arrays is expected"
    for name in kept:
        # Another name might be somebody else's, and one would read what the other left.
        if not isinstance(name, str) or not name.startswith(found.label):
            return f"{found.label!r} remembers {name!r}; a name that begins with its label is due"
    return ""


def columns(label: str, found: Any) -> str:
    """What is wrong with a report; nothing if all is well."""
    if not isinstance(found, Mapping):
        return f"{label!r}: `report` returned {found!r}; a mapping of columns is expected"
    for name, value in found.items():
        if not isinstance(name, str) or not _is_number(value, finite=False):
            return f"{label!r}: `report` has {name!r}: {value!r}; a number is expected"
        if not isfinite(value):
            return f"{label!r}: `report` has {name!r}: {value!r}, which is no number"
    return ""


def _is_number(value: Any, *, finite: bool = True) -> bool:
    is_number = isinstance(value, (int, float, np.integer, np.floating))
    return is_number and not isinstance(value, bool) and (isfinite(value) or not finite)
