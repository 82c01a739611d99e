"""Builder: a scene said in words, then built."""

from __future__ import annotations

from typing import Generic, TypeVar, final

from solidsph.assembly.assembler import Assembler
from solidsph.run.built_scene import BuiltScene
from solidsph.run.hooks import listeners
from solidsph.scene.scene import Scene
from solidsph.scene.scene_builder import SceneBuilder

S = TypeVar("S", bound=BuiltScene)


@final
class Builder(SceneBuilder, Generic[S]):
    """Collects a scene in words, then builds it. Every method returns the builder."""

    def __init__(self, kind: type[S], scene: Scene | None = None) -> None:
        """`kind` is the class of what is built."""
        super().__init__(scene)
        self._kind = kind

    def build(self) -> S:
        """Make every part, check every pair of them, and assemble the simulation.

        Raises:
            BuildError: with every problem found, each with its remedy.
        """
        manager = listeners()
        manager.hook.solidsph_configure(builder=self)
        return Assembler(self.scene(), manager).built(self._kind)
