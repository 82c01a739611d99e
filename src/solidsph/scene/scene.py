"""Scene: the specification of a run, in Python and in TOML."""

from __future__ import annotations

from pathlib import Path
from typing import final

import attrs

from solidsph.scene.scene_data import SceneData
from solidsph.scene.toml_reader import read_text, read_values
from solidsph.scene.toml_writer import toml_of


@final
@attrs.frozen
class Scene(SceneData):
    """Everything that a run depends on."""

    @classmethod
    def read(cls, path: Path | str) -> Scene:
        """Read a TOML file. Paths in it begin in its folder.

        Raises:
            SceneError: the file is missing, is not TOML, or has mistakes.
        """
        file = Path(path)
        return cls(**read_values(read_text(file), str(path), file.parent))

    @classmethod
    def from_toml(cls, text: str, origin: str = "scene") -> Scene:
        """Read TOML text; errors name `origin`. Paths in it begin in the working folder.

        Raises:
            SceneError: the text is not TOML or has mistakes. The parts and places of the scene are
                then checked as well, and all mistakes are reported together.
        """
        return cls(**read_values(text, origin))

    def to_toml(self, folder: Path | None = None) -> str:
        """TOML text from which an equal scene is read.

        Args:
            folder: where the text will stand in a file, for `read`; None for `from_toml`.

        Raises:
            SceneError: the scene holds objects or functions that cannot be written to a file.
        """
        return toml_of(self, folder)
