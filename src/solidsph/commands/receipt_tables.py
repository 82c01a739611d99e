"""Receipts as `solidsph run` shows them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import attrs

from solidsph.commands.console import say, show_table
from solidsph.model.particles import State
from solidsph.run.energy import KINETIC, STRAIN
from solidsph.simulation import Simulation
from solidsph.studies.case import Case
from solidsph.studies.receipts import FINISHED, LARGEST, Receipts, case_changes, percent, receipts


def of_scene(simulation: Simulation, end: State, of: Sequence[str]) -> Receipts:
    """Of a scene that has been run to `end`."""
    return receipts(simulation, end=end, of=of)


def of_case(case: Case, of: Sequence[str]) -> dict[str, Any]:
    """Of every scene of a case that has effects, and how what it measures changes without them."""
    scenes = {}
    for name, scene in case.scenes().items():
        if scene.effects:
            scenes[name] = attrs.asdict(receipts(Simulation.builder(scene).build(), of=of))
    return {"scenes": scenes, "measurements": case_changes(case)}


def show_receipts(found: Receipts, of: Sequence[str]) -> None:
    """A table, and a sentence for each."""
    if not found.each:
        say("receipts: the scene names no effect")
        return
    shown = [*of, LARGEST, KINETIC, STRAIN]
    rows = []
    for one in found.each:
        rows.append(
            [
                one.label,
                _share(one.share),
                one.work,
                *(_percent(one.changes.get(name)) for name in shown),
                "" if one.outcome == FINISHED else one.outcome,
            ]
        )
    heads = [name.partition("=" if "@" in name else " [")[0] for name in shown]
    show_table(
        "receipts: what each effect took, did, and changed",
        ["effect", "of the time", "work [J]", *heads, "without it"],
        rows,
    )
    for one in found.each:
        say(one.line)
    size = "at full size" if found.coarser == 1.0 else f"at {found.coarser:g} times the spacing"
    say(
        f"(time: steps of this scene with and without it, in turns; changes and work: runs {size}, "
        f"{found.particles} particles, {found.duration:g} s)"
    )
    if found.outcome != FINISHED:
        say(f"note: at reduced size the run with all effects {found.outcome}")


def show_case_receipts(found: dict[str, Any]) -> None:
    """Tables: the effects of each scene, and what the case measures."""
    rows = [
        [
            scene,
            one["label"],
            _share(one["share"]),
            one["work"],
            _percent(one["changes"].get(LARGEST)),
            "" if one["outcome"] == FINISHED else one["outcome"],
        ]
        for scene, own in found["scenes"].items()
        for one in own["each"]
    ]
    if not rows:
        say("receipts: no scene of this case names an effect")
        return
    heads = ["scene", "effect", "of the time", "work [J]", "largest displacement", "without it"]
    show_table("receipts: what each effect took, did, and changed", heads, rows)
    changes = [
        [label, quantity, _percent(change)]
        for label, own in found["measurements"].items()
        for quantity, change in own.items()
    ]
    if changes:
        show_table("changed without it", ["effect", "measured", "by"], changes)


def _percent(part: float | None) -> str:
    return "" if part is None else percent(part)


def _share(part: float | None) -> str:
    # What is less than the noise of the clock may come out below nothing.
    return _percent(None if part is None else max(0.0, part))
