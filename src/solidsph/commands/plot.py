"""solidsph plot: pictures of a scene before it runs, or of a record."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import attrs
import click

from solidsph.commands.console import present, progress
from solidsph.commands.options import Output, option, options, output_option, set_option
from solidsph.commands.records import records_in
from solidsph.commands.target import name_of, resolve
from solidsph.errors import SceneError
from solidsph.results.layout import RECORD_SUFFIXES
from solidsph.results.record import Record
from solidsph.simulation import Simulation
from solidsph.studies.case import Case

_PICTURES = (".png", ".svg", ".pdf")

_HDF5 = b"\x89HDF\r\n\x1a\n"
"""What every record begins with."""


@attrs.frozen
class _Options(Output):
    output: Path | None = output_option(
        "Folder for the pictures, or for a scene a file that ends in .png, .svg or .pdf.  "
        "[default: the folder of the record; results/NAME for a scene]"
    )
    field: str | None = option(
        "Field that colours the body of a record.  [default: the largest principal stress]",
        metavar="NAME",
    )
    settings: tuple[str, ...] = set_option()


@click.command()
@click.argument("target", metavar="RECORD|FOLDER|SCENE|-|CASE")
@options(_Options)
def plot(target: str, options: _Options) -> None:
    """Draw a scene before it runs, or the pictures of a record or of all in a FOLDER.

    Of a scene: bodies with their particles, named faces and tags, who is held in which direction,
    loads where they are largest, walls, joints and probes. Nothing is run. Of a record: the
    deformed body, coloured by a field, the energies, and what the probes measured.
    """
    path = Path(target)
    if path.is_dir() or _is_record(path):
        if options.settings:
            raise SceneError(f"--set changes a scene, and {target!r} holds records; leave it out")
        pictures, kind = list(_of_records(path, options)), "record"
    else:
        if options.field is not None:
            raise SceneError(
                f"--field colours a record, and {target!r} is a scene; leave it out, or run it"
            )
        pictures, kind = list(_of_scenes(target, options)), "scene"
    facts = {kind: target, "pictures": [str(picture) for picture in pictures]}
    present(facts, [f"picture: {picture}" for picture in pictures], as_json=options.as_json)


def _is_record(path: Path) -> bool:
    if path.suffix in RECORD_SUFFIXES:
        return True
    with suppress(OSError), path.open("rb") as file:
        return file.read(len(_HDF5)) == _HDF5
    return False


def _of_records(path: Path, options: _Options) -> Iterator[Path]:
    from solidsph.results.pictures import draw  # imports the plotting library

    chosen = {} if options.field is None else {"field": options.field}
    for one in records_in(path):
        with Record(one) as record:
            yield from draw(record, options.output or one.parent, one.stem, **chosen)


def _of_scenes(target: str, options: _Options) -> Iterator[Path]:
    try:
        wanted = resolve(target, options.settings)
    except SceneError as cause:
        if Path(target).is_file() and not target.endswith(".toml"):
            raise SceneError(f"{target!r} is no record, and no scene either: {cause}") from None
        raise
    scenes = wanted.scenes() if isinstance(wanted, Case) else {"scene": wanted}
    if not scenes:
        raise SceneError(f"the case {target!r} has no scene to draw; solidsph run {target} runs it")
    for path, scene in zip(
        _files(list(scenes), target, options.output), scenes.values(), strict=True
    ):
        with progress(options.progress):
            figure = Simulation.builder(scene).plot()
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=150, bbox_inches="tight")
        yield path


def _files(names: list[str], target: str, output: Path | None) -> list[Path]:
    """The file of each scene."""
    if output is None or not output.suffix or output.is_dir():
        folder = output or Path("results") / name_of(target)
        return [folder / f"{name}.png" for name in names]
    if output.suffix.lower() not in _PICTURES:
        raise SceneError(
            f"--output {str(output)!r}: a picture ends in {', '.join(_PICTURES)}; a folder has no "
            "such ending"
        )
    if len(names) > 1:
        listed = ", ".join(names)
        raise SceneError(
            f"--output {str(output)!r}: {target!r} has several scenes ({listed}); give a folder"
        )
    return [output]
