"""Origin of an error: the part whose code raised it, by name and distribution."""

from __future__ import annotations

from collections.abc import Iterable
from traceback import walk_tb

from solidsph.registry.registry import Entry, singular

_BUILT_IN = "solidsph"


def described(entry: Entry) -> str:
    """The part as a message names it: kind, name, class and distribution."""
    origin = f"from {entry.distribution} {entry.version}" if entry.distribution else "from Python"
    name = entry.name or entry.target.rpartition(".")[2].rpartition(":")[2]
    return f"{singular(entry.kind)} {name!r} ({entry.target}, {origin})"


def is_foreign(entry: Entry) -> bool:
    """True if the part is not built in, so that no test of solidsph checks it."""
    return entry.distribution != _BUILT_IN


def failing_part(cause: BaseException, entries: Iterable[Entry]) -> str:
    """The part among `entries` whose code raised, as a message names it; "" if none did."""
    parts = list(entries)
    for frame, _ in reversed(list(walk_tb(cause.__traceback__))):
        near = [e for e in parts if e.target.partition(":")[0] == frame.f_globals.get("__name__")]
        if not near:
            continue
        place = frame.f_code.co_qualname
        exact = [e for e in near if place.startswith(e.target.partition(":")[2] + ".")]
        label = getattr(frame.f_locals.get("self"), "label", None)
        if not exact and isinstance(label, str):  # a term: of an effect or a boundary
            exact = [e for e in near if e.kind in ("effects", "boundaries")]
        elif not exact and "self" in frame.f_locals:  # another object of that module
            continue
        part = described((exact or near)[0])
        return f"{part}, label {label!r}" if isinstance(label, str) else part
    return ""


def foreign_parts(entries: Iterable[Entry]) -> str:
    """The parts among `entries` that are not built in, as a message names them."""
    return " or ".join(described(entry) for entry in entries if is_foreign(entry))


def failure(cause: BaseException, entries: Iterable[Entry], otherwise: str) -> str:
    """A message about an unexpected error: which part failed, and how.

    Args:
        cause: the error.
        entries: the parts in use.
        otherwise: what to name if no part raised and none is foreign.
    """
    parts = list(entries)
    who = failing_part(cause, parts) or foreign_parts(parts) or otherwise
    return (
        f"{who} failed: {type(cause).__name__}: {cause}; this is an error in that part, which "
        "should explain what is wrong with its input (solidsph check tests it alone)"
    )
