"""Moments in the life of a run at which plugins may listen.

Entry points provide nouns, parts of which one is chosen by name; hooks provide verbs, moments
that any number of listeners hear. Hooks never choose parts and never run inside a step.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping
from traceback import walk_tb

import pluggy

from solidsph.errors import DivergedError, PluginError
from solidsph.interfaces.terms import Observation
from solidsph.maths.arrays import Array
from solidsph.model.particles import State
from solidsph.registry.registry import hook_points
from solidsph.run.built_scene import BuiltScene
from solidsph.scene.scene_builder import SceneBuilder

STRICT = "SOLIDSPH_STRICT_PLUGINS"
"""Environment variable: if set to 1, a hook plugin that cannot be loaded is an error."""

specification = pluggy.HookspecMarker("solidsph")
implementation = pluggy.HookimplMarker("solidsph")


class Moments:
    """The moments, in the order in which they come."""

    @specification
    def solidsph_configure(self, builder: SceneBuilder) -> None:
        """Before a scene is built: the builder may still be changed."""

    @specification
    def solidsph_setup(self, simulation: BuiltScene) -> None:
        """Before the first step of a run."""

    @specification
    def solidsph_resume(
        self, simulation: BuiltScene, observation: Observation, kept: Mapping[str, Array]
    ) -> None:
        """Before the first step of a run that goes on from an output of an earlier one.

        `kept` holds what listeners put there by `solidsph_keep` at that output.
        """

    @specification
    def solidsph_step_end(self, simulation: BuiltScene, observation: Observation) -> None:
        """At every output, the first state included. Read only."""

    @specification
    def solidsph_keep(self, simulation: BuiltScene, kept: dict[str, Array]) -> None:
        """After an output of a recorded run: put into `kept`, under names that begin with your
        own, arrays of numbers that you need to go on from there. State that evolves with the
        motion belongs into `State.memory` instead."""

    @specification
    def solidsph_failure(self, simulation: BuiltScene, state: State, error: DivergedError) -> None:
        """When the motion went wrong: `state` is the last one. `error` may be told more."""

    @specification
    def solidsph_finish(self, simulation: BuiltScene, outcome: str) -> None:
        """After the last step, or after the run stopped on an error: `outcome` says which."""


def heard_by(cause: BaseException, manager: pluggy.PluginManager) -> str:
    """The installed hook plugin whose code raised, as a message names it; nothing if none did."""
    points = {point.name: point for point in hook_points()}
    modules = {
        getattr(plugin, "__name__", type(plugin).__module__): points[name]
        for name, plugin in manager.list_name_plugin()
        if name in points and plugin is not None
    }
    for frame, _ in reversed(list(walk_tb(cause.__traceback__))):
        point = modules.get(frame.f_globals.get("__name__", ""))
        if point is not None:
            origin = f"{point.dist.name} {point.dist.version}" if point.dist else "unknown"
            return f"hook plugin {point.name!r} ({point.value}, from {origin})"
    return ""


def listeners() -> pluggy.PluginManager:
    """A manager with every installed hook plugin registered.

    A plugin that cannot be loaded is left out with a warning that names it.

    Raises:
        PluginError: instead of that warning, where SOLIDSPH_STRICT_PLUGINS is 1.
    """
    manager = pluggy.PluginManager("solidsph")
    manager.add_hookspecs(Moments)
    heard: dict[str, str] = {}
    for point in hook_points():
        distribution = f"{point.dist.name} {point.dist.version}" if point.dist else "unknown"
        plugin = None
        try:
            if point.name in heard:
                raise PluginError(f"{heard[point.name]} has that name already")
            plugin = point.load()
            manager.register(plugin, name=point.name)
            manager.check_pending()
        except Exception as cause:
            # Only this one: of two with one name, the first is heard.
            if plugin is not None and manager.get_plugin(point.name) is plugin:
                manager.unregister(plugin)
            message = (
                f"hook plugin {point.name!r} ({point.value}, from {distribution}) is left out: "
                f"{type(cause).__name__}: {cause}; repair or uninstall it"
            )
            if os.environ.get(STRICT) == "1":
                raise PluginError(message) from cause
            warnings.warn(message, stacklevel=2)
        else:
            heard[point.name] = f"{point.value}, from {distribution}"
    return manager
