"""Builder: the specification of a scene, and its assembly."""

from __future__ import annotations

import time as clock
from typing import TYPE_CHECKING, Generic, TypeVar, final

from solidsph.assembly.assembler import Assembler
from solidsph.run.built_scene import BuiltScene
from solidsph.run.hooks import load_hook_plugins
from solidsph.scene.scene import Scene
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.system.build_log import tell_built

if TYPE_CHECKING:
    from matplotlib.figure import Figure

S = TypeVar("S", bound=BuiltScene)


@final
class Builder(SceneBuilder, Generic[S]):
    """Builder of a scene as an object of one class. Every method returns the builder."""

    def __init__(self, kind: type[S], scene: Scene | None = None) -> None:
        """Start from an empty or a given scene; `kind` is the class of the result."""
        super().__init__(scene)
        self._kind = kind

    def build(self) -> S:
        """Make every part, check that the parts fit each other, and assemble the simulation.

        Raises:
            BuildError: with all problems, each with its remedy.
        """
        manager = load_hook_plugins()
        manager.hook.solidsph_configure(builder=self)
        begun = clock.perf_counter()
        built = Assembler(self.scene(), manager).assemble(self._kind)
        seconds, pairs = clock.perf_counter() - begun, built.dynamics.internal.pair_count
        count = built.particles.count
        tell_built("built %d particles with %d pairs in %.3g s", count, pairs, seconds)
        return built

    def plot(self) -> Figure:
        """A picture of the scene before it runs: bodies, particles, named faces and tags, who is
        held, loads and probes. Of the simulation only what it shows is built.

        Raises:
            BuildError: with all problems, each with its remedy.
        """
        from solidsph.assembly.arrangement import arrangement_of
        from solidsph.results.arrangement_picture import arrangement_figure  # imports Matplotlib

        load_hook_plugins().hook.solidsph_configure(builder=self)
        return arrangement_figure(arrangement_of(self.scene()))
