"""Scene: what a user asks for; TOML in and out."""

from __future__ import annotations

from pathlib import Path
from typing import final

import attrs

from solidsph.scene.scene_data import SceneData
from solidsph.scene.toml_reader import text_of, words
from solidsph.scene.toml_writer import toml_of


@final
@attrs.frozen
class Scene(SceneData):
    """Everything that a run depends on."""

    @classmethod
    def read(cls, path: Path) -> Scene:
        """From a TOML file.

        Raises:
            SceneError: the file is missing, is not TOML, or says something unknown.
        """
        return cls.from_toml(text_of(path), str(path))

    @classmethod
    def from_toml(cls, text: str, origin: str = "scene") -> Scene:
        """From TOML text; `origin` is named in errors.

        Raises:
            SceneError: it is not TOML, or says something unknown. Then the scene is also looked
                through for whatever else is wrong with it, and all of it is told together.
        """
        return cls(**words(text, origin))

    def to_toml(self) -> str:
        """TOML text from which an equal scene is read.

        Raises:
            SceneError: the scene holds objects or functions that a file cannot.
        """
        return toml_of(self)
