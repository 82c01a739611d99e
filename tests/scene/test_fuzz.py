"""Whatever a scene holds: an answer, one message, no traceback, no end without end."""

from __future__ import annotations

import warnings
from pathlib import Path

import pytest

from solidsph import BuildError, Scene, Simulation
from solidsph_builtin.discretisations import _checks
from tests.helpers.fuzzing import campaign, tried
from tests.helpers.scenes import SCENE_TOML
from tests.helpers.waiting import HANG


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """A scene of millions of particles is in order; here there is no time for it."""
    monkeypatch.setattr(_checks, "MOST_PARTICLES", 2e3)


def assert_all_answered(count: int, seed: int) -> None:
    wrong: list[str] = []

    def heard(data: bytes, told: str) -> None:
        wrong.append(f"{told}\n{data.decode(errors='backslashreplace')}")

    with warnings.catch_warnings():
        # Parts may warn of what they are asked for; what NumPy warns of stays an error.
        warnings.simplefilter("ignore", UserWarning)
        counts = campaign(count, seed, HANG, heard)
    print(counts)
    assert wrong == []
    # Of each kind enough to say something.
    assert counts["built"] > 0.05 * count
    assert counts["refused"] > 0.5 * count


@pytest.mark.usefixtures("small")
def test_spoilt_scenes() -> None:
    assert_all_answered(60, seed=0)


@pytest.mark.validation
@pytest.mark.usefixtures("small")
@pytest.mark.parametrize("seed", range(1, 5))
def test_ten_thousand_spoilt_scenes(seed: int) -> None:
    assert_all_answered(2500, seed)


@pytest.mark.parametrize(
    "formula",
    [
        "__import__('os').system('touch HERE')",
        "().__class__.__base__.__subclasses__()",
        "open('HERE', 'w')",
        "[x for x in (1,)]",
        "(lambda: 0)()",
        "X.__class__",
        "f'{X}'",
        "9**9**9**9",
        "(" * 5000 + "X" + ")" * 5000,
        "-" * 20000 + "1",
    ],
)
def test_a_formula_never_runs_code(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, formula: str
) -> None:
    monkeypatch.chdir(tmp_path)
    text = SCENE_TOML.replace("1e3*min(t/0.005, 1)", formula)
    assert text != SCENE_TOML
    assert tried(text.encode(), HANG) == "refused"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("value", ["1" + "0" * 400, "-1" + "0" * 30, "inf", "nan"])
def test_numbers_without_end(value: str) -> None:
    """A whole number that no double holds is refused; one that a double holds is a number."""
    text = SCENE_TOML.replace('{x = "1e3*min(t/0.005, 1)"}', f"{{x = {value}}}")
    assert text != SCENE_TOML
    expected = "built" if value.endswith("0" * 30) and len(value) < 40 else "refused"
    assert tried(text.encode(), HANG) == expected


def test_a_cover_beyond_all_use_is_refused() -> None:
    with pytest.raises(BuildError, match=r"cover must not exceed 100, got 3000"):
        Simulation.builder(
            Scene.from_toml(SCENE_TOML.replace("cover = 3.0", "cover = 3e3"))
        ).build()
