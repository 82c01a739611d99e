"""Blame: which part an error that nobody foresaw came from, by name and distribution."""

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
    """Whether the part is none of our own, which tests hold to their promises."""
    return entry.distribution != _BUILT_IN


def culprit(cause: BaseException, entries: Iterable[Entry]) -> str:
    """The part among `entries` whose code raised, as a message names it; nothing if none did."""
    own = list(entries)
    for frame, _ in reversed(list(walk_tb(cause.__traceback__))):
        near = [e for e in own if e.target.partition(":")[0] == frame.f_globals.get("__name__")]
        if not near:
            continue
        place = frame.f_code.co_qualname
        exact = [e for e in near if place.startswith(e.target.partition(":")[2] + ".")]
        label = getattr(frame.f_locals.get("self"), "label", None)
        if not exact and isinstance(label, str):  # a condition: of an effect or a boundary
            exact = [e for e in near if e.kind in ("effects", "boundaries")]
        elif not exact and "self" in frame.f_locals:  # something else of that module
            continue
        found = described((exact or near)[0])
        return f"{found}, label {label!r}" if isinstance(label, str) else found
    return ""


def suspects(entries: Iterable[Entry]) -> str:
    """Those among `entries` that no test of ours holds to its promises, as a message names them."""
    return " or ".join(described(entry) for entry in entries if is_foreign(entry))


def told(cause: BaseException, entries: Iterable[Entry], otherwise: str) -> str:
    """What failed and how, where a part is at fault; `otherwise` names it if no part's code did."""
    own = list(entries)
    who = culprit(cause, own) or suspects(own) or otherwise
    return (
        f"{who} failed: {type(cause).__name__}: {cause}; this is a fault of that part, which "
        "should explain what it was given (solidsph check tests it alone)"
    )
