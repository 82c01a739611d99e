"""solidsph run: run a scene or a case, and record it."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs
import click

from solidsph.advice import Advice, advise
from solidsph.commands import prediction as predictions
from solidsph.commands.accuracy import Accurate, accurate, beside_references
from solidsph.commands.console import (
    Table,
    known_facts,
    present,
    progress,
    progress_observers,
    say,
)
from solidsph.commands.limit_tables import with_warnings
from solidsph.commands.options import (
    FILE,
    Output,
    SearchOptions,
    flag,
    option,
    option_group,
    options,
    output_option,
    set_option,
)
from solidsph.commands.receipt_tables import case_receipts, case_receipts_text, receipts_text
from solidsph.commands.target import name_of, resolve, target_argument
from solidsph.costs.memory_check import check_memory
from solidsph.costs.model import Prediction
from solidsph.costs.process import peak_memory
from solidsph.errors import SceneError, UnsoundError
from solidsph.results.earlier_run import check_replaceable
from solidsph.results.layout import RECORD_SUFFIXES
from solidsph.results.sole_writer import check_no_writer
from solidsph.run.outcome import FINISHED
from solidsph.scene.scene import Scene
from solidsph.simulation import Simulation
from solidsph.studies.case import Case
from solidsph.studies.case_run import CaseResult, run_case
from solidsph.studies.quantity import columns_of
from solidsph.studies.receipts import quantity, receipts
from solidsph.studies.scene_case import references_of
from solidsph.watch import Finding, run_watched

LOG = logging.getLogger(__name__)


_SUMMED = (
    "note: work is summed up by the trapezoidal rule over the load steps; the energy residual is "
    "the error of that sum, and falls with the square of their number (statics.load_steps)"
)


@attrs.frozen
class _Options(Output):
    settings: tuple[str, ...] = set_option()
    output: Path | None = output_option(
        "Folder for records and pictures, or for a scene the file of its record (.h5 or .vtkhdf).  "
        "[default: results/NAME]"
    )
    overwrite: bool = flag("Replace the record of an interrupted run, which resume would continue.")
    write: Path | None = option("Write the scene to this file instead of running it.", type=FILE)
    watch: bool | None = option(
        "Look for signs of failure at outputs.  [default: watch the motion of a scene]",
        "--watch/--no-watch",
        default=None,  # click's own for a flag is False
    )
    roll_back: int = option(
        "On a failure, go back to the last sound output and halve the step, up to N times.",
        type=click.IntRange(min=0),
        default=0,
        metavar="N",
    )
    accuracy: str | None = option(
        "Search for the quickest spacing with this error, such as 1%, run that, and give every "
        "probe with its error bar.",
        metavar="PERCENT",
    )
    search: SearchOptions = option_group(SearchOptions)
    receipts: bool = flag(
        "Then report what each effect cost and changed, by runs without it at reduced size."
    )
    receipts_of: tuple[str, ...] = option(
        "With --receipts: also compare this displacement, or this column of the history.",
        multiple=True,
        metavar="NAME=x@[X,Y]",
    )
    beyond_memory: bool = flag("Run even if more memory is predicted than is free.")

    def check_memory(self, scene: Scene) -> None:
        """Refuse a scene that needs more memory than is free, unless that is wanted."""
        if not self.beyond_memory:
            check_memory(scene)

    def check_record(self, path: Path) -> str:
        """Refuse to replace a record that must stay; tell which one is replaced, if any."""
        check_no_writer(path)
        earlier = check_replaceable(path, overwrite=self.overwrite)
        if earlier is None or not earlier.count:
            return ""
        return f"{path} holds {earlier.description}; it is replaced"


@click.command()
@target_argument()
@options(_Options)
def run(target: str, options: _Options) -> None:
    """Run a scene or a case, and record it. A scene is a file, or - for the standard input."""
    wanted = resolve(target, options.settings)
    if options.write is not None:
        _write(wanted, options.write, as_json=options.as_json)
        return
    if options.receipts_of and not options.receipts:
        raise SceneError("--receipts-of says what --receipts is to look at; add --receipts")
    for text in options.receipts_of:
        quantity(text)  # refused before the run
    folder = options.output or Path("results") / name_of(target)
    watch = options.watch or options.roll_back
    if isinstance(wanted, Case):
        if options.accuracy is not None or options.search.of:
            raise SceneError(
                "--accuracy is for a scene; of a case ask: solidsph cost CASE --accuracy"
            )
        if watch:
            raise SceneError(
                "--watch is for one scene, and a case is several, some of which diverge on "
                "purpose; write them to files (--write) and run one"
            )
        _run_case(target, wanted, folder, options)
        return
    if options.roll_back and options.watch is False:
        raise SceneError("--roll-back needs --watch, which finds the last sound output")
    if watch and wanted.statics is not None:
        raise SceneError("--watch is for motions; an equilibrium is tested by itself")
    path = folder if folder.suffix in RECORD_SUFFIXES else folder / "record.h5"
    if options.accuracy is None:
        if options.search.of:
            raise SceneError("--of says what --accuracy is of; add --accuracy, such as 1%")
        _run_scene(target, wanted, path, options)
        return
    options.check_record(path)
    found = accurate(
        name_of(target),
        wanted,
        options.accuracy,
        of=options.search.of,
        longest=options.search.longest,
        folder=path.parent / "search",
        shown=options.progress,
    )
    if found.best is None:
        present(found.facts, found.text(), as_json=options.as_json, passed=False)
    _run_scene(target, found.scene, path, options, found)


def _write(wanted: Scene | Case, path: Path, *, as_json: bool) -> None:
    written: list[str] = []
    scenes = wanted.scenes() if isinstance(wanted, Case) else {"": wanted}
    for name, scene in scenes.items():
        file = path if len(scenes) == 1 else path.with_stem(f"{path.stem}-{name}")
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(scene.to_toml(file.parent), encoding="utf-8")
        written.append(str(file))
    facts = {"outcome": "written", "exit code": 0, "files": written}
    present(facts, [f"wrote {file}" for file in written], as_json=as_json)


def _run_scene(
    target: str, scene: Scene, path: Path, options: _Options, found: Accurate | None = None
) -> None:
    options.check_memory(scene)
    replaced = options.check_record(path)
    known = known_facts()
    known |= {"scene": target, "record": str(path), "warnings": []}
    with progress(options.progress):
        simulation, build = predictions.build_timed(scene)
    references = references_of(scene, columns_of(simulation)) if scene.references else ()
    advice = advise(simulation)
    known["warnings"] += [warning.line for warning in advice]
    if replaced:  # said when nothing in the scene is refused any more
        LOG.warning(replaced)
    if not options.as_json:
        _warn(advice)
    predicted = predictions.try_prediction(simulation, build)
    if options.progress and (announcement := predictions.announcement(predicted)):
        say(announcement)
    unsound: UnsoundError | None = None
    with progress(options.progress) as display:
        observers = progress_observers(display, name_of(target), simulation)
        try:
            if options.watch is False or scene.statics is not None:
                result = simulation.run(record=path, observers=observers)
            else:
                watchdog = _Watchdog(known["warnings"])
                result = run_watched(
                    simulation,
                    record=path,
                    roll_backs=options.roll_back,
                    observers=observers,
                    on_finding=watchdog,
                )
        except UnsoundError as cause:
            # The result is shown before the error.
            if cause.result is None:
                raise
            unsound, result = cause, cause.result
    memory = peak_memory()
    effort: dict[str, Any] = {
        "particles": simulation.particles.count,
        "pairs": simulation.dynamics.internal.pair_count,
        **predictions.work_done(predicted, result.effort),
        **result.effort,
        "build time [s]": build.seconds,
        "wall time [s]": result.seconds,
        "peak memory [MiB]": memory / 2**20,
        **predictions.comparison(predicted, result.seconds, memory),
    }
    # Notes and final values are not read from the file, which other processes may replace.
    known |= {**effort, "notes": list(result.notes), "final": result.final}
    compared = beside_references(path, references)
    bars = found.write_bars(path) if found is not None else ()
    if found is not None:
        known |= {"accuracy": found.facts, "error bars": bars}
    known["references"] = compared
    passed = all(row["as expected"] for row in compared)
    of = options.receipts_of
    effects = receipts(simulation, end=result.state, of=of) if options.receipts else None
    if effects is not None:
        known["receipts"] = attrs.asdict(effects)
    hidden = frozenset() if options.verbose else predictions.INTERNALS

    def text() -> Iterator[Table | str]:
        values = {name: value for name, value in effort.items() if name not in hidden}
        yield Table.of_values(target, values)
        yield Table.of_values("at the end", result.final, "quantity")
        yield from with_warnings("with error bars", bars)
        if compared:
            yield Table.of("beside the references", compared, list(compared[0]))
            yield "verdict: " + ("as expected" if passed else "NOT as expected")
        if found is not None:
            yield found.sentence
        if scene.statics is not None:
            yield _SUMMED
        yield from (f"note: {note}" for note in result.notes)
        yield f"record: {path} (open it in ParaView, or with: solidsph plot {path})"
        if effects is not None:
            yield from receipts_text(effects, of)

    if unsound is None or not options.as_json:
        facts = {**known, "outcome": FINISHED, "exit code": 0 if passed else 1}
        present(facts, text(), as_json=options.as_json, passed=passed or unsound is not None)
    if unsound is not None:
        raise unsound


def _warn(advice: Sequence[Advice], scene: str = "") -> None:
    """Print warnings ahead of a run on the standard error."""
    where = f"{scene}, " if scene else ""
    lines = [f"warning, {where}{a.name}: {a.finding}. Remedy: {a.remedy}" for a in advice]
    if lines:
        LOG.warning("\n".join([*lines, '(more: solidsph explain; to silence: silence = ["NAME"])']))


@attrs.frozen
class _Watchdog:
    """Prints what the watchdog of a run finds, once for every remedy."""

    warnings: list[str]  # to be extended
    _remedies: set[str] = attrs.field(factory=set)

    def __call__(self, time: float, finding: Finding) -> None:
        if finding.remedy in self._remedies:
            return
        self._remedies.add(finding.remedy)
        text = (
            f"watchdog, {finding.grade.value} at t = {time:.6g} s: {finding.cause} at "
            f"particle {finding.particle}; try {finding.remedy}"
        )
        self.warnings.append(text)
        LOG.warning(text)


def _run_case(target: str, case: Case, folder: Path, options: _Options) -> None:
    for name in case.scenes():
        if replaced := options.check_record(folder / f"{name}.h5"):
            LOG.warning(replaced)
    known = known_facts()
    known |= {"case": target, "warnings": {}}
    predicted: dict[str, Prediction | None] = {}
    warned: set[str] = set()
    with progress(options.progress) as display:

        def begin(name: str, simulation: Simulation) -> Sequence[object]:
            compiled = {c for p in predicted.values() if p for c in p.work.compilations}
            predicted[name] = predictions.try_prediction(simulation, None, compiled)
            advice = advise(simulation)
            if advice:
                known["warnings"][name] = [warning.line for warning in advice]
            if not options.as_json:  # each warning once a case, at the first scene it is about
                _warn([warning for warning in advice if warning.name not in warned], name)
            warned.update(warning.name for warning in advice)
            return progress_observers(display, name, simulation)

        result = run_case(case, folder, ahead=options.check_memory, begin=begin)
    seconds = {name: None if p is None else p.run_seconds for name, p in predicted.items()}
    facts = {
        **known,
        "outcome": "as predicted" if result.passed else "not as predicted",
        "exit code": 0 if result.passed else 1,
        "passed": result.passed,
        "peak memory [bytes]": result.peak_memory,
        "predicted": predictions.total_comparison(result.runs, seconds),
        **_case_facts(result, seconds),
    }
    if options.receipts:
        facts["receipts"] = case_receipts(case, options.receipts_of)
    text = _case_text(case, folder, facts)
    present(facts, text, as_json=options.as_json, passed=result.passed)


def _case_facts(result: CaseResult, predicted: Mapping[str, float | None]) -> dict[str, Any]:
    return {
        "measurements": [
            {
                "quantity": m.quantity,
                "value": m.value,
                "unit": m.unit,
                "reference": m.reference,
                "source": m.source,
                "error": m.error,
                "verdict": m.verdict,
                "as expected": m.passed,
                "paper": m.paper,
            }
            for m in result.measurements
        ],
        "runs": [
            {
                "scene": run.name,
                "outcome": run.outcome,
                "wall time [s]": run.seconds,
                "predicted wall time [s]": predicted[run.name],
                "steps": run.steps,
                "particles": run.particles,
                "pairs": run.pairs,
                "record": str(run.record),
            }
            for run in result.runs
        ],
        "pictures": [str(path) for path in result.pictures],
        "tables": [str(path) for path in result.tables],
    }


def _case_text(case: Case, folder: Path, facts: Mapping[str, Any]) -> Iterator[Table | str]:
    measurements, runs = facts["measurements"], facts["runs"]
    yield f"{case.title}. {case.source}."
    keys = ("quantity", "value", "reference", "unit", "error", "verdict", "as expected")
    yield Table.of("measurements", measurements, keys, {"value": "measured"})
    if runs:
        yield Table.of("runs", runs, list(runs[0])[:-1])  # all but the record
        yield Table.of_values("all runs", facts["predicted"])
    sources = sorted({row["source"] for row in measurements if row["source"]})
    yield from (f"reference: {source}" for source in sources)
    yield from (f"picture: {path}" for path in facts["pictures"])
    yield from (f"data: {path}" for path in facts["tables"])
    if runs:
        yield f"records: {folder}/*.h5 (open them in ParaView, or with: solidsph plot FILE)"
    if "receipts" in facts:
        yield from case_receipts_text(facts["receipts"])
    yield "verdict: " + ("as the source predicts" if facts["passed"] else "NOT as predicted")
