"""The kits of all kinds of part, and how to run one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from solidsph.conformance.check import Check, CheckResult
from solidsph.conformance.kits import KITS
from solidsph.errors import SceneError
from solidsph.registry.construct import construct
from solidsph.testing import boundary, effect, engine, formulation

_KITS: Mapping[str, Sequence[Check]] = {
    **KITS,
    "boundaries": boundary.KIT.checks,
    "formulations": formulation.KIT.checks,
    "engines": engine.KIT.checks,
    "effects": effect.KIT.checks,
}


def kits() -> tuple[str, ...]:
    """Kinds of part that have a kit."""
    return tuple(_KITS)


def checks(kind: str) -> tuple[Check, ...]:
    """The checks of a kind, such as "kernels"; each is a function of a part.

    Raises:
        SceneError: there is no kit for that kind.
    """
    if kind not in _KITS:
        raise SceneError(f"there is no conformance kit for {kind!r}; kits: {', '.join(_KITS)}")
    return tuple(_KITS[kind])


def conformance(kind: str, part: object) -> list[CheckResult]:
    """Run every check of a kind on a part: an object, a registered name, or a table.

    Raises:
        SceneError: there is no kit for that kind, or `part` is not of it.
    """
    made = construct(kind, part)
    return [check(made) for check in checks(kind)]
