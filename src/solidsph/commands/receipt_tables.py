"""Receipts of effects as tables of `solidsph run`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import attrs

from solidsph.commands.console import Table
from solidsph.run.energy import KINETIC, STRAIN
from solidsph.run.outcome import FINISHED
from solidsph.simulation import Simulation
from solidsph.studies.case import Case
from solidsph.studies.receipts import (
    LARGEST,
    Receipts,
    case_changes,
    percent,
    receipts,
    short_name,
)

_TITLE = "receipts: cost, work and influence of each effect"


def case_receipts(case: Case, of: Sequence[str]) -> dict[str, Any]:
    """Receipts of every scene of a case that has effects, and the changes of its measurements."""
    scenes = {
        name: attrs.asdict(receipts(Simulation.builder(scene).build(), of=of))
        for name, scene in case.scenes().items()
        if scene.effects
    }
    return {"scenes": scenes, "measurements": case_changes(case)}


def receipts_text(result: Receipts, of: Sequence[str]) -> Iterator[Table | str]:
    """Table of the receipts of a scene, and a sentence for each."""
    if not result.each:
        yield "receipts: the scene names no effect"
        return
    quantities = [*of, LARGEST, KINETIC, STRAIN]
    columns = ["effect", "of the time", "work [J]", *map(short_name, quantities), "without it"]
    yield Table(
        _TITLE, columns, [_row(attrs.asdict(receipt), quantities) for receipt in result.each]
    )
    yield from (receipt.line for receipt in result.each)
    size = "at full size" if result.coarser == 1.0 else f"at {result.coarser:g} times the spacing"
    yield (
        "(time: steps of this scene with and without the effect, in turns; changes and work: runs "
        f"{size}, {result.particles} particles, {result.duration:g} s)"
    )
    if result.outcome != FINISHED:
        yield f"note: at reduced size the run with all effects {result.outcome}"


def case_receipts_text(facts: Mapping[str, Any]) -> Iterator[Table | str]:
    """Tables of `case_receipts`."""
    rows = [
        [scene, *_row(receipt, [LARGEST])]
        for scene, result in facts["scenes"].items()
        for receipt in result["each"]
    ]
    if not rows:
        yield "receipts: no scene of this case names an effect"
        return
    columns = ["effect", "of the time", "work [J]", short_name(LARGEST), "without it"]
    yield Table(_TITLE, ["scene", *columns], rows)
    changes = [
        [label, quantity, percent(change)]
        for label, quantities in facts["measurements"].items()
        for quantity, change in quantities.items()
    ]
    if changes:
        yield Table("changed without it", ["effect", "measurement", "by"], changes)


def _row(receipt: Mapping[str, Any], quantities: Sequence[str]) -> list[Any]:
    share, outcome = receipt["share"], receipt["outcome"]
    changes = (receipt["changes"].get(name) for name in quantities)
    return [
        receipt["label"],
        # A share below the noise of the clock may be negative.
        "" if share is None else percent(max(0.0, share)),
        receipt["work"],
        *("" if change is None else percent(change) for change in changes),
        "" if outcome == FINISHED else outcome,
    ]
