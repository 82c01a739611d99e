"""Makes a clean copy of a record whose writer was killed, for programs that refuse such a file."""

from __future__ import annotations

from pathlib import Path

from solidsph.errors import RecordError
from solidsph.results.layout import RUNNING, Field
from solidsph.results.record import Record
from solidsph.results.record_writer import RecordWriter


def repaired(path: Path, target: Path) -> int:
    """Copies every step that can be read into a new, closed record; returns their number.

    Args:
        path: a record, in any state that `Record` opens; it is left as it is.
        target: the copy, replaced if it exists. Its outcome is "interrupted" if `path` has none.

    Raises:
        RecordError: `path` cannot be read, or `target` not be written or is the same file.
    """
    path, target = Path(path), Path(target)
    if target.exists() and path.exists() and path.samefile(target):
        raise RecordError(f"{path} cannot be its own repaired copy; name another file")
    with Record(path) as record:
        fields = {name: record.field(name) for name in record.field_names}
        writer = RecordWriter(
            target,
            record.particles,
            scene=record.scene,
            plugins=record.plugins,
            fields=[Field(name, each.shape[2:], each.unit) for name, each in fields.items()],
            columns=record.history_units,
            versions=record.versions,
            notes=record.notes,
            folder=record.folder,
        )
        with writer:
            for i, time in enumerate(record.times):
                writer.append(
                    float(time),
                    int(record.steps[i]),
                    record.positions[i],
                    {name: each[i] for name, each in fields.items()},
                    {name: float(values[i]) for name, values in record.history.items()},
                )
            writer.close("interrupted" if record.outcome == RUNNING else record.outcome)
            return writer.count
