"""`python -m tests.bare FOLDER [SCENE ...]`: the table of bare scenes, and their plots."""

from __future__ import annotations

import sys
from pathlib import Path

from tests.bare.plots import draw
from tests.bare.registry import SCENES
from tests.bare.study import HEADING, studied


def main(arguments: list[str]) -> int:
    """Exit code 0 if all pass, 1 if one does not, 2 if the input is wrong."""
    folder, *names = arguments or [""]
    unknown = [name for name in names if name not in SCENES]
    if not folder or unknown:
        print(f"usage: python -m tests.bare FOLDER [SCENE ...]; scenes: {', '.join(SCENES)}")
        return 2
    studies, faults = [], 0
    print(HEADING)
    for name in names or SCENES:
        study = studied(name)
        studies.append(study)
        print(*study.rows(), *(f"    {fault}" for fault in study.faults()), sep="\n", flush=True)
        faults += any(True for _ in study.faults())
    print(f"{len(studies) - faults} of {len(studies)} pass; {draw(studies, Path(folder))}")
    return int(faults > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
