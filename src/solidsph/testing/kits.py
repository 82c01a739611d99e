"""Which kinds of part have a kit, and how to run one."""

from __future__ import annotations

from collections.abc import Mapping

from solidsph.errors import SceneError
from solidsph.promises.check import Check, CheckResult
from solidsph.promises.kits import KITS
from solidsph.registry.construct import construct
from solidsph.testing import boundary, effect, formulation

_KITS: Mapping[str, tuple[Check, ...]] = {
    **KITS,
    "boundaries": boundary.CHECKS,
    "formulations": formulation.CHECKS,
    "effects": effect.CHECKS,
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
    return _KITS[kind]


def conformance(kind: str, part: object) -> list[CheckResult]:
    """Run every check of a kind on a part: an object, a registered name, or a table.

    Raises:
        SceneError: there is no kit for that kind, or `part` is not of it.
    """
    made = construct(kind, part)
    return [one(made) for one in checks(kind)]
