"""Finding, loading and refusing parts. Foreign distributions are made for each test."""

from __future__ import annotations

import subprocess
import sys

import pytest

from solidsph.errors import PluginError, SceneError
from solidsph.interfaces.kernel import Kernel
from solidsph.registry import registry

GOOD_KERNEL = """
    import attrs, numpy as np
    from solidsph import Kernel

    @attrs.frozen
    class Hat(Kernel):
        @staticmethod
        def profile(q, params):
            return np.maximum(1.0 - q, 0.0)
"""


def test_a_foreign_kernel_is_found_and_loaded(foreign) -> None:
    foreign("foreign-hat", "foreign_hat", GOOD_KERNEL, "[solidsph.kernels]\nhat = foreign_hat:Hat")
    entry = registry.find("kernels", "hat")
    assert (entry.distribution, entry.version) == ("foreign-hat", "1.2")
    assert issubclass(registry.load("kernels", "hat"), Kernel)


def test_a_broken_plugin_matters_only_when_asked_for(foreign) -> None:
    foreign(
        "foreign-broken",
        "foreign_broken",
        "import a_module_that_is_not_there",
        "[solidsph.kernels]\nbroken = foreign_broken:Broken",
    )
    assert "broken" in registry.names("kernels")
    assert registry.load("kernels", "cubic-spline")
    with pytest.raises(PluginError) as caught:
        registry.load("kernels", "broken")
    message = str(caught.value)
    for fact in (
        "kernel 'broken'",
        "foreign_broken:Broken",
        "foreign-broken 1.2",
        "ModuleNotFoundError",
        "a_module_that_is_not_there",
    ):
        assert fact in message
    assert isinstance(caught.value.__cause__, ModuleNotFoundError)


def test_two_distributions_claiming_one_name(foreign) -> None:
    foreign("foreign-a", "foreign_a", GOOD_KERNEL, "[solidsph.kernels]\ntwin = foreign_a:Hat")
    foreign("foreign-b", "foreign_b", GOOD_KERNEL, "[solidsph.kernels]\ntwin = foreign_b:Hat")
    assert registry.load("kernels", "cubic-spline")
    with pytest.raises(PluginError, match=r"claimed by foreign-a 1.2 .* and foreign-b 1.2"):
        registry.load("kernels", "twin")


def test_claiming_a_builtin_name_is_refused_as_well(foreign) -> None:
    foreign(
        "foreign-a", "foreign_a", GOOD_KERNEL, "[solidsph.kernels]\ncubic-spline = foreign_a:Hat"
    )
    with pytest.raises(PluginError, match=r"claimed by foreign-a 1.2 .* and solidsph"):
        registry.load("kernels", "cubic-spline")


@pytest.mark.parametrize(
    ("source", "target", "expected"),
    [
        ("value = 3", "value", "is not a solidsph.interfaces.kernel.Kernel"),
        ("class Loose: pass", "Loose", "is not a solidsph.interfaces.kernel.Kernel"),
        (
            "from solidsph import Kernel\nclass Empty(Kernel): pass",
            "Empty",
            "does not implement profile",
        ),
        ("x = 1", "absent", "AttributeError"),
        ("raise SystemError('odd')", "Any", "SystemError: odd"),
    ],
)
def test_a_plugin_that_keeps_no_interface(foreign, source, target, expected) -> None:
    foreign("foreign-bad", "foreign_bad", source, f"[solidsph.kernels]\nbad = foreign_bad:{target}")
    with pytest.raises(PluginError, match=expected):
        registry.load("kernels", "bad")


def test_an_unknown_name_has_the_nearest_match() -> None:
    with pytest.raises(SceneError, match=r"unknown kernel 'cubic-splin'; did you mean 'cubic-sp"):
        registry.load("kernels", "cubic-splin")


def test_distributions_can_be_restricted(monkeypatch: pytest.MonkeyPatch, foreign) -> None:
    foreign("foreign-hat", "foreign_hat", GOOD_KERNEL, "[solidsph.kernels]\nhat = foreign_hat:Hat")
    monkeypatch.setenv(registry.RESTRICT, "solidsph")
    assert "hat" not in registry.names("kernels")
    assert "cubic-spline" in registry.names("kernels")
    monkeypatch.setenv(registry.RESTRICT, "foreign-hat")
    assert registry.names("kernels") == ("hat",)


def test_hook_plugins_listen_and_broken_ones_are_left_out_loudly(
    foreign, monkeypatch: pytest.MonkeyPatch
) -> None:
    from solidsph.run.hooks import STRICT, load_hook_plugins

    foreign(
        "foreign-hooks",
        "foreign_hooks",
        """
        from solidsph.run.hooks import implementation
        heard = []
        @implementation
        def solidsph_configure(builder):
            heard.append(builder)
        """,
        "[solidsph.hooks]\nears = foreign_hooks",
    )
    foreign(
        "foreign-misspelt",
        "foreign_misspelt",
        """
        from solidsph.run.hooks import implementation
        @implementation
        def solidsph_configrue(builder):
            pass
        """,
        "[solidsph.hooks]\nmisspelt = foreign_misspelt",
    )
    with pytest.warns(UserWarning, match=r"'misspelt' .* foreign-misspelt 1.2.*configrue"):
        manager = load_hook_plugins()
    manager.hook.solidsph_configure(builder="this one")
    import foreign_hooks

    assert foreign_hooks.heard == ["this one"]
    monkeypatch.setenv(STRICT, "1")
    with pytest.raises(PluginError, match="misspelt"):
        load_hook_plugins()


def test_of_two_hooks_of_one_name_the_first_is_heard(
    foreign, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And the warning names both, whatever is wrong with the second."""
    from solidsph.run.hooks import STRICT, load_hook_plugins

    script = """
    from solidsph.run.hooks import implementation
    heard = []
    @implementation
    def solidsph_configure(builder):
        heard.append(builder)
    """
    foreign("foreign-alpha", "foreign_alpha", script, "[solidsph.hooks]\near = foreign_alpha")
    foreign("foreign-beta", "foreign_beta", script, "[solidsph.hooks]\near = foreign_beta")
    with pytest.warns(UserWarning, match="is left out") as warned:
        manager = load_hook_plugins()
    manager.hook.solidsph_configure(builder="this one")
    loaded = [
        sys.modules[f"foreign_{name}"]
        for name in ("alpha", "beta")
        if f"foreign_{name}" in sys.modules
    ]
    assert [one.heard for one in loaded if one.heard] == [["this one"]]
    texts = [str(one.message) for one in warned]
    assert any("foreign-alpha 1.2" in one and "foreign-beta 1.2" in one for one in texts)
    monkeypatch.setenv(STRICT, "1")
    with pytest.raises(PluginError, match="has that name already"):
        load_hook_plugins()


def test_hooks_hear_the_life_of_a_run(foreign) -> None:
    script = """
    from solidsph.run.hooks import implementation
    moments = []
    @implementation
    def solidsph_configure(builder):
        builder.outputs(3)
        moments.append("configure")
    @implementation
    def solidsph_setup(simulation):
        moments.append("setup")
    @implementation
    def solidsph_step_end(simulation, observation):
        moments.append(observation.state.step)
    @implementation
    def solidsph_finish(simulation, outcome):
        moments.append(outcome)
    """
    foreign("foreign-life", "foreign_life", script, "[solidsph.hooks]\nlife = foreign_life")
    from tests.helpers.scenes import box

    simulation = box(1).build()
    simulation.run()
    import foreign_life

    steps = [0, *simulation.output_steps()]
    assert foreign_life.moments == ["configure", "setup", *steps, "finished"]
    assert len(steps) == 4


def test_the_command_line_shows_a_plugin_error_without_a_traceback(foreign, tmp_path) -> None:
    foreign(
        "foreign-broken",
        "foreign_broken",
        "import a_module_that_is_not_there",
        "[solidsph.kernels]\nbroken = foreign_broken:Broken",
    )
    from tests.helpers.scenes import SCENE_TOML

    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE_TOML.replace("modified-mollifier", "broken"))
    done = subprocess.run(
        [sys.executable, "-m", "solidsph", "explain", str(scene)],
        capture_output=True,
        text=True,
        env={"PYTHONPATH": str(tmp_path / "foreign-broken"), "PATH": "/usr/bin:/bin"},
        check=False,
    )
    assert done.returncode == 2, done.stderr
    assert "a_module_that_is_not_there" in done.stderr
    assert "Traceback" not in done.stderr
