"""Problems of a scene, collected so that all are reported together."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Sequence
from typing import TypeVar

from solidsph.errors import BuildError, PluginError, SolidsphError
from solidsph.registry.origin import failure
from solidsph.registry.registry import Entry

T = TypeVar("T")

_MEMORY = "there is not enough memory for so many particles or pairs; use a larger spacing"

# A scene of a thousand bodies can have the same problem a thousand times.
MOST_OF_A_KIND = 10
_MOST_CHARACTERS = 1500

# Names and numbers, by which problems of one kind differ.
_PARTICULAR = re.compile(r"'[^']*'|\"[^\"]*\"|[-+]?\d[\d.]*(?:e[-+]?\d+)?")


def summarised(problems: Iterable[str]) -> list[str]:
    """Each problem once, shortened; of each kind the first ten and a count of the others."""
    seen: Counter[str] = Counter()
    shown: dict[str, str] = {}
    for problem in dict.fromkeys(problems):
        kind = _PARTICULAR.sub("", problem)
        seen[kind] += 1
        if seen[kind] <= MOST_OF_A_KIND:
            shown[problem] = kind
    lines: list[str] = []
    last = {kind: problem for problem, kind in shown.items()}
    for problem, kind in shown.items():
        lines.append(_shortened(problem))
        if problem == last[kind] and seen[kind] > MOST_OF_A_KIND:
            lines.append(f"and {seen[kind] - MOST_OF_A_KIND} more of this kind")
    return lines


def listed(origin: str, problems: Sequence[str]) -> str:
    """One message of several problems of `origin`."""
    if len(problems) == 1:
        return f"{origin}: {problems[0]}"
    return "\n  - ".join([f"{origin}: {len(problems)} problems:", *problems])


def _shortened(problem: str) -> str:
    if len(problem) <= _MOST_CHARACTERS:
        return problem
    half = _MOST_CHARACTERS // 2
    return f"{problem[:half]} ... {problem[-half:]}"


class Problems:
    """Problems found so far, each with its remedy."""

    def __init__(self, used: Collection[Entry] = ()) -> None:
        self._found: list[str] = []
        self._used = used  # parts that may be the cause of an error; may grow

    @property
    def found(self) -> Sequence[str]:
        """All problems so far, each once, and of many of one kind the first."""
        return summarised(self._found)

    def add(self, problems: Iterable[str]) -> None:
        """Add problems."""
        self._found += problems

    def attempt(self, make: Callable[..., T], *arguments: object) -> T | None:
        """The value of `make(*arguments)`, or None if it fails; its problem is added."""
        try:
            return make(*arguments)
        except BuildError as cause:
            self.add(cause.problems)
        except SolidsphError as cause:
            self.add([str(cause)])
        except MemoryError:
            self.add([_MEMORY])
        except Warning:  # if the user has turned warnings into errors
            raise
        except Exception as cause:  # a plugin's code may fail in any way
            owner = type(getattr(make, "__self__", make))
            otherwise = f"{owner.__module__}.{owner.__qualname__}"
            raise PluginError(failure(cause, self._used, otherwise)) from cause
        return None

    def stop_if_any(self) -> None:
        """Raise BuildError with all problems so far, if there are any."""
        if self._found:
            raise BuildError(self.found)

    def settled(self, value: T | None) -> T:
        """The value of an attempt; raises BuildError with all problems if it failed."""
        if value is None:
            self.stop_if_any()
            raise AssertionError("an attempt gave no value and added no problem")
        return value
