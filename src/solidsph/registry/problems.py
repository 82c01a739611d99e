"""Problems: everything that is wrong with a scene, found before any of it is reported."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Sequence
from typing import TypeVar

from solidsph.errors import BuildError, PluginError, SolidsphError
from solidsph.registry.origin import told
from solidsph.registry.registry import Entry

T = TypeVar("T")


_MEMORY = "there is not enough memory for so many particles or pairs; use a larger spacing"


# A scene of a thousand bodies can be wrong in one way a thousand times.
MOST_OF_A_KIND = 10
_MOST_CHARACTERS = 1500

# What differs between problems of one kind: names and numbers.
_PARTICULAR = re.compile(r"'[^']*'|\"[^\"]*\"|[-+]?\d[\d.]*(?:e[-+]?\d+)?")


def summarised(problems: Iterable[str]) -> list[str]:
    """Each problem once and at a length that can be read; of a kind the first ten and a count."""
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
    """One message of several problems of what `origin` names."""
    if len(problems) == 1:
        return f"{origin}: {problems[0]}"
    return "\n  - ".join([f"{origin}: {len(problems)} problems:", *problems])


def _shortened(problem: str) -> str:
    if len(problem) <= _MOST_CHARACTERS:
        return problem
    half = _MOST_CHARACTERS // 2
    return f"{problem[:half]} ... {problem[-half:]}"


class Problems:
    """Collects problems, each with its remedy, until it makes no sense to look further."""

    def __init__(self, used: Collection[Entry] = ()) -> None:
        self._found: list[str] = []
        self._used = used  # plugins that may be at fault; it may grow

    @property
    def found(self) -> Sequence[str]:
        """All that were noted so far; each once, and of many of one kind the first."""
        return summarised(self._found)

    def add(self, problems: Iterable[str]) -> None:
        """Note some problems."""
        self._found += problems

    def attempt(self, make: Callable[..., T], *arguments: object) -> T | None:
        """The value of `make(*arguments)`, or None with its problem noted."""
        try:
            return make(*arguments)
        except BuildError as cause:
            self.add(cause.problems)
        except SolidsphError as cause:
            self.add([str(cause)])
        except MemoryError:
            self.add([_MEMORY])
        except Warning:  # where the user has asked for warnings to be errors
            raise
        except Exception as cause:  # a plugin's code may fail in any way
            owner = type(getattr(make, "__self__", make))
            otherwise = f"{owner.__module__}.{owner.__qualname__}"
            raise PluginError(told(cause, self._used, otherwise)) from cause
        return None

    def stop_if_any(self) -> None:
        """Raise BuildError with all problems noted so far, if there are any."""
        if self._found:
            raise BuildError(self.found)

    def settled(self, value: T | None) -> T:
        """A value that an attempt has made; raises BuildError with its problems if it has not."""
        if value is None:
            self.stop_if_any()
            raise AssertionError("an attempt gave no value and noted no problem")
        return value
