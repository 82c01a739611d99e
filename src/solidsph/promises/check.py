"""A check measures one promise of a part; a kit is the tuple of checks for one kind of part."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import wraps
from inspect import getdoc
from typing import Any, TypeAlias, TypeVar

import attrs

from solidsph.errors import PartWarning

Part = TypeVar("Part")


@attrs.frozen
class CheckResult:
    """What one check found."""

    name: str
    passed: bool
    measured: str
    required: str
    checked: bool = True  # False: the part does not promise it, and nothing was asked of it


Check: TypeAlias = Callable[[Any], CheckResult]
"""A plain function of a part; it never raises."""


@attrs.frozen
class Verdict:
    """A measurement and whether it keeps the promise."""

    passed: bool
    measured: str
    checked: bool = True


def check(measure: Callable[[Part], Verdict]) -> Callable[[Part], CheckResult]:
    """Make a check of a function that measures: its name and docstring say what is required.

    An exception becomes a failed result that carries its message.
    """
    name = measure.__name__.replace("_", " ")
    required = " ".join((getdoc(measure) or name).split("\n\n")[0].split()).rstrip(".")

    @wraps(measure)
    def checked(part: Part) -> CheckResult:
        try:
            with warnings.catch_warnings():
                # What the first use of a part asks, the kit asks too, and tells as a result.
                warnings.simplefilter("ignore", PartWarning)
                verdict = measure(part)
        except Exception as cause:
            verdict = Verdict(False, f"{type(cause).__name__}: {cause}")
        return CheckResult(name, verdict.passed, verdict.measured, required, verdict.checked)

    return checked


def at_most(error: float, limit: float) -> Verdict:
    """Passed if `error` is a number no larger than `limit`."""
    return Verdict(bool(error <= limit), f"{error:.1e} (at most {limit:g})")


def more_than(value: float, limit: float) -> Verdict:
    """Passed if `value` is a number larger than `limit`: a declared shortcoming must be there."""
    return Verdict(bool(value > limit), f"{value:.1e} (more than {limit:g})")


def not_promised(reason: str) -> Verdict:
    """Not failed, and not checked: the part declares that it does not promise this."""
    return Verdict(True, f"not promised: {reason}", checked=False)


def worst(verdicts: list[Verdict]) -> Verdict:
    """The first that failed, or else the last."""
    return next((one for one in verdicts if not one.passed), verdicts[-1])
