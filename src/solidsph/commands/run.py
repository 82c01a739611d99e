"""solidsph run: carry out a scene or a case."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs
import click
from rich.markup import escape

from solidsph.commands.console import (
    ProgressObserver,
    err,
    facts,
    progress,
    say,
    show_json,
    show_table,
)
from solidsph.commands.target import name_of, resolve
from solidsph.errors import SceneError, UnsoundError
from solidsph.results.layout import RECORD_SUFFIXES
from solidsph.scene.scene import Scene
from solidsph.studies.case import Case, Measurement

if TYPE_CHECKING:
    from solidsph.costs.model import Prediction
    from solidsph.interfaces.plan import Compilation
    from solidsph.watch import Finding


@click.command()
@click.argument("target", metavar="SCENE|-|CASE")
@click.option("--set", "settings", multiple=True, metavar="NAME=VALUE", help="A case's parameter.")
@click.option(
    "--output",
    type=click.Path(path_type=Path),
    help="Folder for records and pictures.  [default: results/NAME]  Of a scene also the file for "
    "its record, if it ends in .h5 or .vtkhdf.",
)
@click.option(
    "--overwrite",
    is_flag=True,
    help="Replace the record of a run that was interrupted, and that resume would go on with.",
)
@click.option(
    "--write",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Write the scene to this file instead of running it.",
)
@click.option(
    "--watch/--no-watch",
    default=None,
    help="Look for signs of failure at outputs: a scene is watched unless it is not to be.",
)
@click.option(
    "--roll-back",
    "roll_backs",
    type=click.IntRange(min=0),
    default=0,
    metavar="N",
    help="On a failure: go back to the last sound output and halve the step, up to N times.",
)
@click.option(
    "--receipts",
    is_flag=True,
    help="Then say of each effect what it took and what it changed, by runs without it at reduced "
    "size.",
)
@click.option(
    "--receipts-of",
    "receipts_of",
    multiple=True,
    metavar="NAME=x@[X,Y]",
    help="With --receipts: a displacement to look at, or a column of the history.",
)
@click.option(
    "--beyond-memory",
    "beyond_memory",
    is_flag=True,
    help="Run although more memory is predicted than this machine has free.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of tables.")
@click.option("--quiet", is_flag=True, help="Show no progress.")
def run(
    target: str,
    settings: tuple[str, ...],
    output: Path | None,
    overwrite: bool,
    write: Path | None,
    watch: bool | None,
    roll_backs: int,
    receipts: bool,
    receipts_of: tuple[str, ...],
    beyond_memory: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Run a scene file, a scene from the standard input (-) or a case, and record it."""
    wanted = resolve(target, settings)
    if write is not None:
        _write(wanted, write, as_json=as_json)
        return
    folder = output or Path("results") / name_of(target)
    shown = not (as_json or quiet)
    ahead = _unchecked if beyond_memory else _checked
    if receipts_of and not receipts:
        raise SceneError("--receipts-of says what --receipts is to look at; add --receipts")
    if receipts_of:
        from solidsph.studies.receipts import quantity

        for one in receipts_of:
            quantity(one)  # what is not understood is said before the run
    wanted_receipts = receipts_of if receipts else None
    if isinstance(wanted, Case):
        if watch or roll_backs:
            raise SceneError(
                "--watch is for one scene, and a case is several, some of which diverge on "
                "purpose; write them to files (--write) and run one"
            )
        for name in wanted.scenes():
            _make_way(folder / f"{name}.h5", overwrite=overwrite)
        _run_case(
            target, wanted, folder, wanted_receipts, ahead=ahead, shown=shown, as_json=as_json
        )
        return
    if roll_backs and watch is False:
        raise SceneError("--roll-back needs --watch, which finds the last sound output")
    if (watch or roll_backs) and wanted.statics is not None:
        raise SceneError("--watch is for motions; an equilibrium is tested by itself")
    ahead(wanted)
    watched = None if watch is False or wanted.statics is not None else roll_backs
    path = folder if folder.suffix in RECORD_SUFFIXES else folder / "record.h5"
    _make_way(path, overwrite=overwrite)
    _run_scene(target, wanted, path, wanted_receipts, watched=watched, shown=shown, as_json=as_json)


def _make_way(path: Path, *, overwrite: bool) -> None:
    """Say what a new record takes the place of, if it may."""
    from solidsph.results.left import check_replaceable
    from solidsph.results.sole_writer import check_no_writer

    check_no_writer(path)
    left = check_replaceable(path, overwrite=overwrite)
    if left is not None and left.count:
        err.print(escape(f"{path} holds {left.told()}; it is replaced"), soft_wrap=True)


def _checked(scene: Scene) -> None:
    from solidsph.costs.memory_check import check_memory

    check_memory(scene)


def _unchecked(scene: Scene) -> None:
    pass


def _write(wanted: Scene | Case, path: Path, *, as_json: bool) -> None:
    written: list[str] = []
    scenes = wanted.scenes() if isinstance(wanted, Case) else {"": wanted}
    for name, scene in scenes.items():
        own = path if len(scenes) == 1 else path.with_stem(f"{path.stem}-{name}")
        own.parent.mkdir(parents=True, exist_ok=True)
        own.write_text(scene.to_toml(), encoding="utf-8")
        written.append(str(own))
    if as_json:
        show_json({"outcome": "written", "exit code": 0, "files": written})
        return
    for file in written:
        say(f"wrote {file}")


def _run_scene(
    target: str,
    scene: Scene,
    path: Path,
    receipts_of: Sequence[str] | None,
    *,
    watched: int | None,
    shown: bool,
    as_json: bool,
) -> None:
    from solidsph.advice import advised
    from solidsph.commands import prediction as told
    from solidsph.commands.receipted import of_scene, show_receipts
    from solidsph.commands.warned import warn
    from solidsph.costs.process import peak_memory

    known = facts()
    known |= {"scene": target, "record": str(path), "warnings": []}
    simulation, build = told.built(scene)
    advice = advised(simulation)
    known["warnings"] += [one.line for one in advice]
    if not as_json:
        warn({"": advice})
    prediction = told.of_run(simulation, build)
    if shown and prediction is not None and prediction.seconds > told.LONG:
        say(told.announcement(prediction))
    unsound: UnsoundError | None = None
    with progress(shown) as display:
        observers = [ProgressObserver(display, name_of(target), simulation)] if display else []
        try:
            if watched is None:
                result = simulation.run(record=path, observers=observers)
            else:
                from solidsph.watch import run_watched

                heard = _Once(known["warnings"])
                result = run_watched(
                    simulation, record=path, roll_backs=watched, observers=observers, told=heard
                )
        except UnsoundError as cause:
            # What it came to is shown, and then that it is not to be used.
            if cause.result is None:
                raise
            unsound, result = cause, cause.result
    history, notes = result.final, result.notes  # not from the file, which others may replace
    memory = peak_memory()
    effort: dict[str, Any] = {
        "particles": simulation.particles.count,
        "pairs": simulation.dynamics.internal.pair_count,
        **({} if prediction is None else told.work_done(prediction.work, result.effort)),
        **result.effort,
        "build time [s]": build.seconds,
        "wall time [s]": result.seconds,
        "peak memory [MiB]": memory / 2**20,
        **told.scored(prediction, result.seconds, memory),
    }
    found = None if receipts_of is None else of_scene(simulation, result.state, receipts_of)
    known |= {**effort, "notes": list(notes), "final": history}
    known |= {} if found is None else {"receipts": attrs.asdict(found)}
    if unsound is None and as_json:
        show_json({**known, "outcome": "finished", "exit code": 0})
        return
    if not as_json:
        _show_scene(target, path, effort, history, notes)
        if found is not None:
            show_receipts(found, receipts_of or ())
    if unsound is not None:
        raise unsound


def _show_scene(
    target: str,
    path: Path,
    effort: Mapping[str, Any],
    history: Mapping[str, float],
    notes: Sequence[str],
) -> None:
    show_table(target, ["", "value"], [[key, value] for key, value in effort.items()])
    show_table("at the end", ["quantity", "value"], [[k, v] for k, v in history.items()])
    for note in notes:
        say(f"note: {note}")
    say(f"record: {path} (ParaView opens it; so does: solidsph plot {path})")


class _Once:
    """Tells what a watchdog finds, the first time of each remedy."""

    def __init__(self, warnings: list[str]) -> None:
        self._told: set[str] = set()
        self._warnings = warnings  # to which it is added

    def __call__(self, time: float, finding: Finding) -> None:
        if finding.remedy not in self._told:
            self._told.add(finding.remedy)
            text = (
                f"watchdog, {finding.grade.value} at t = {time:.6g} s: {finding.cause} at "
                f"particle {finding.particle}; try {finding.remedy}"
            )
            self._warnings.append(text)
            err.print(escape(text), soft_wrap=True)


def _run_case(
    target: str,
    case: Case,
    folder: Path,
    receipts_of: Sequence[str] | None,
    *,
    ahead: Callable[[Scene], None],
    shown: bool,
    as_json: bool,
) -> None:
    from solidsph.advice import Advice, advised
    from solidsph.commands import prediction as told
    from solidsph.commands.receipted import of_case, show_case_receipts
    from solidsph.commands.warned import warn
    from solidsph.studies.case_run import run_case

    known = facts()
    known |= {"case": target, "warnings": {}}
    advice: dict[str, Sequence[Advice]] = {}
    case_predictions: dict[str, Prediction | None] = {}
    compiled: set[Compilation] = set()
    with progress(shown) as display:

        def begin(name: str, simulation: Any) -> Sequence[object]:
            case_predictions[name] = told.of_run(simulation, None, frozenset(compiled))
            compiled.update(told.compilations(case_predictions[name]))
            before = {one.name for several in advice.values() for one in several}
            advice[name] = advised(simulation)
            if advice[name]:
                known["warnings"][name] = [one.line for one in advice[name]]
            if not as_json:  # each warning once a case, at the first scene that it is about
                warn({name: [one for one in advice[name] if one.name not in before]})
            return [ProgressObserver(display, name, simulation)] if display else []

        result = run_case(case, folder, ahead=ahead, begin=begin)
    predictions = told.scores(case_predictions, result.runs)
    found = None if receipts_of is None else of_case(case, receipts_of)
    if as_json:
        show_json(
            {
                **known,
                "outcome": "as predicted" if result.passed else "not as predicted",
                "exit code": 0 if result.passed else 1,
                "passed": result.passed,
                "peak memory [bytes]": result.peak_memory,
                "predicted": told.sums(result.runs, predictions),
                "measurements": [_row(m) for m in result.measurements],
                "runs": [
                    {
                        "scene": r.name,
                        "outcome": r.outcome,
                        "wall time [s]": r.seconds,
                        "predicted wall time [s]": predictions[r.name],
                        "steps": r.steps,
                        "particles": r.particles,
                        "pairs": r.pairs,
                        "record": str(r.record),
                    }
                    for r in result.runs
                ],
                "pictures": [str(path) for path in result.pictures],
                "tables": [str(path) for path in result.tables],
                **({} if found is None else {"receipts": found}),
            }
        )
    else:
        say(f"{case.title}. {case.source}.")
        show_table(
            "measured",
            ["quantity", "measured", "reference", "unit", "error", "verdict", "as expected"],
            [
                [m.quantity, m.value, m.reference, m.unit, m.error, m.verdict, m.passed]
                for m in result.measurements
            ],
        )
        if result.runs:
            show_table(
                "runs",
                ["scene", "outcome", "wall time [s]", "predicted", "steps", "particles", "pairs"],
                [
                    [
                        r.name,
                        r.outcome,
                        r.seconds,
                        predictions[r.name],
                        r.steps,
                        r.particles,
                        r.pairs,
                    ]
                    for r in result.runs
                ],
            )
            together = told.sums(result.runs, predictions)
            show_table("all runs", ["", "value"], [[k, v] for k, v in together.items()])
        sources = {m.source for m in result.measurements if m.source}
        for source in sorted(sources):
            say(f"reference: {source}")
        for path in result.pictures:
            say(f"picture: {path}")
        for path in result.tables:
            say(f"data: {path}")
        if result.runs:
            say(f"records: {folder}/*.h5 (ParaView opens them; so does: solidsph plot FILE)")
        if found is not None:
            show_case_receipts(found)
        say("verdict: " + ("as the source predicts" if result.passed else "NOT as predicted"))
    if not result.passed:
        raise SystemExit(1)


def _row(measurement: Measurement) -> dict[str, Any]:
    return {
        "quantity": measurement.quantity,
        "value": measurement.value,
        "unit": measurement.unit,
        "reference": measurement.reference,
        "source": measurement.source,
        "error": measurement.error,
        "verdict": measurement.verdict,
        "as expected": measurement.passed,
        "paper": measurement.paper,
    }
