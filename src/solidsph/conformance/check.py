"""A kit: the checks of one kind of part. A check measures one promise of the interface."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable
from functools import wraps
from inspect import getdoc
from typing import Any, TypeAlias

import attrs
import numpy as np

from solidsph.errors import PartWarning, PortableError


@attrs.frozen
class CheckResult:
    """The outcome of one check."""

    name: str
    passed: bool
    measured: str
    required: str
    checked: bool = True  # False: the part does not promise it, so nothing was measured


Check: TypeAlias = Callable[[Any], CheckResult]
"""A plain function of a part; it never raises."""


@attrs.frozen
class Verdict:
    """A measurement and whether it keeps the promise."""

    passed: bool
    measured: str
    checked: bool = True


class Broken(PortableError):  # noqa: N818 (an outcome of a check, no error)
    """Ends a check: the promise is broken, as the message says."""


class NotPromised(PortableError):  # noqa: N818 (an outcome of a check, no error)
    """Ends a check: the part declares that it does not promise this, as the message says."""


class Kit:
    """The checks of one kind of part, in the order of their definition.

    The name of a check and the first paragraph of its docstring say what is required. An exception
    becomes a failed result that carries its message.
    """

    def __init__(self) -> None:
        self.checks: list[Check] = []

    def check(self, measure: Callable[[Any], Verdict]) -> Check:
        """Add a check that returns its verdict."""
        name = measure.__name__.replace("_", " ")
        required = " ".join((getdoc(measure) or name).split("\n\n")[0].split()).rstrip(".")

        @wraps(measure)
        def checked(part: Any) -> CheckResult:
            try:
                with warnings.catch_warnings():
                    # The first use of a part warns of what the kit reports as a result.
                    warnings.simplefilter("ignore", PartWarning)
                    verdict = measure(part)
            except Broken as cause:
                verdict = Verdict(False, str(cause))
            except NotPromised as cause:
                verdict = Verdict(True, f"not promised: {cause}", checked=False)
            except Exception as cause:
                verdict = Verdict(False, f"{type(cause).__name__}: {cause}")
            return CheckResult(name, verdict.passed, verdict.measured, required, verdict.checked)

        self.checks.append(checked)
        return checked

    def errors(
        self, limit: float, *, none: str = "there is nothing to measure"
    ) -> Callable[[Callable[[Any], Iterable[float]]], Check]:
        """Add a check that yields errors, each of which must be at most `limit`.

        `none` says why a part that yields no error does not promise this.
        """

        def add(measure: Callable[[Any], Iterable[float]]) -> Check:
            @wraps(measure)
            def largest(part: Any) -> Verdict:
                errors = list(measure(part))
                if not errors:
                    raise NotPromised(none)
                return at_most(float(np.max(errors)), limit)

            return self.check(largest)

        return add

    def problems(
        self, otherwise: str, *, none: str = ""
    ) -> Callable[[Callable[[Any], Iterable[str]]], Check]:
        """Add a check that yields a description of each problem, or "" where there is none.

        Args:
            otherwise: the measurement where there is no problem.
            none: why a part for which nothing is yielded does not promise this.
        """

        def add(measure: Callable[[Any], Iterable[str]]) -> Check:
            @wraps(measure)
            def first(part: Any) -> Verdict:
                asked = False
                for problem in measure(part):
                    asked = True
                    if problem:
                        raise Broken(problem)
                if none and not asked:
                    raise NotPromised(none)
                return Verdict(True, otherwise)

            return self.check(first)

        return add


def at_most(error: float, limit: float) -> Verdict:
    """Passed if `error` is a number no larger than `limit`."""
    return Verdict(bool(error <= limit), f"{error:.1e} (at most {limit:g})")


def more_than(value: float, limit: float) -> Verdict:
    """Passed if `value` is a number larger than `limit`: a declared shortcoming must be there."""
    return Verdict(bool(value > limit), f"{value:.1e} (more than {limit:g})")


def worst(verdicts: list[Verdict]) -> Verdict:
    """The first that failed, or else the last."""
    return next((verdict for verdict in verdicts if not verdict.passed), verdicts[-1])
