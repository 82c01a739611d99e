"""Notes of what is compiled and on disk: predictions of a run read them, and a run writes them."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from functools import cache

import attrs

from solidsph.engines.compiled.environment import environment
from solidsph.interfaces.plan import Compilation
from solidsph.system.cache import COMPILATIONS


def looked_up(units: Iterable[Compilation]) -> frozenset[Compilation]:
    """The compilations, with those marked that are on disk."""
    return frozenset(
        attrs.evolve(unit, on_disk=COMPILATIONS.read(_note(unit)) is not None) for unit in units
    )


@cache
def note(units: frozenset[Compilation]) -> None:
    """Note that these have been compiled, and so are on disk."""
    for unit in units:
        # Before a body is built, the key is not known.
        for noted in (unit, attrs.evolve(unit, key=None)):
            COMPILATIONS.write(_note(noted), b"")


def _note(unit: Compilation) -> str:
    # The classes in a key are known by their names.
    text = repr((unit.unit.name, unit.dimension, unit.threaded, unit.key, environment()))
    return hashlib.sha256(text.encode()).hexdigest()
