"""Hooks: events of a run that plugins and observers can listen to.

Hooks never choose parts and never run within a step.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping
from importlib.metadata import EntryPoint
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


class Hooks:
    """Specifications of all hooks, in the order of their calls."""

    @specification
    def solidsph_configure(self, builder: SceneBuilder) -> None:
        """Called before a scene is built, while the builder can still be changed."""

    @specification
    def solidsph_setup(self, simulation: BuiltScene) -> None:
        """Called before the first step of a run."""

    @specification
    def solidsph_resume(
        self, simulation: BuiltScene, observation: Observation, kept: Mapping[str, Array]
    ) -> None:
        """Called before the first step of a run that resumes an earlier one.

        `kept` holds the arrays that listeners stored by `solidsph_keep` at the output resumed.
        """

    @specification
    def solidsph_step_end(self, simulation: BuiltScene, observation: Observation) -> None:
        """Called at every output, the initial state included. All arguments are read-only."""

    @specification
    def solidsph_keep(self, simulation: BuiltScene, kept: dict[str, Array]) -> None:
        """Called after each output of a recorded run, to store arrays needed to resume from it.

        Put them into `kept`, under names that begin with the name of the listener. State that
        evolves with the motion belongs into `State.memory` instead.
        """

    @specification
    def solidsph_failure(self, simulation: BuiltScene, state: State, error: DivergedError) -> None:
        """Called when the motion diverged after `state`; listeners may add to `error`."""

    @specification
    def solidsph_finish(self, simulation: BuiltScene, outcome: str) -> None:
        """Called after the last step or an error, as `outcome` states."""


def failed_plugin(cause: BaseException, manager: pluggy.PluginManager) -> str:
    """Description of the installed hook plugin whose code raised `cause`; empty if none did."""
    points = {point.name: point for point in hook_points()}
    modules = {
        getattr(plugin, "__name__", type(plugin).__module__): points[name]
        for name, plugin in manager.list_name_plugin()
        if name in points and plugin is not None
    }
    for frame, _ in reversed(list(walk_tb(cause.__traceback__))):
        point = modules.get(frame.f_globals.get("__name__", ""))
        if point is not None:
            return f"hook plugin {point.name!r} ({_origin(point)})"
    return ""


def load_hook_plugins() -> pluggy.PluginManager:
    """Manager with all installed hook plugins.

    A plugin that cannot be loaded is left out with a warning.

    Raises:
        PluginError: instead of the warning, if SOLIDSPH_STRICT_PLUGINS is 1.
    """
    manager = pluggy.PluginManager("solidsph")
    manager.add_hookspecs(Hooks)
    loaded: dict[str, str] = {}
    for point in hook_points():
        plugin = None
        try:
            if point.name in loaded:
                raise PluginError(f"{loaded[point.name]} has that name already")
            plugin = point.load()
            manager.register(plugin, name=point.name)
            manager.check_pending()
        except Exception as cause:
            # Of two plugins with the same name the first stays registered.
            if plugin is not None and manager.get_plugin(point.name) is plugin:
                manager.unregister(plugin)
            message = (
                f"hook plugin {point.name!r} ({_origin(point)}) is left out: "
                f"{type(cause).__name__}: {cause}; repair or uninstall it"
            )
            if os.environ.get(STRICT) == "1":
                raise PluginError(message) from cause
            warnings.warn(message, stacklevel=2)
        else:
            loaded[point.name] = _origin(point)
    return manager


def _origin(point: EntryPoint) -> str:
    distribution = f"{point.dist.name} {point.dist.version}" if point.dist else "unknown"
    return f"{point.value}, from {distribution}"
