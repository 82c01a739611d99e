"""Names that do not exist: the message lists those that do."""

from __future__ import annotations

import pytest

from solidsph.errors import BuildError
from tests.helpers.scenes import box


def told(where: str, tags: int) -> str:
    names = {f"part-{number}": f"X < 0.{number + 1:02d}1" for number in range(10, 10 + tags)}
    scene = box(2, tags=names).boundary("clamp", where=where)
    with pytest.raises(BuildError) as caught:
        scene.build()
    return str(caught.value)


def test_a_few_are_all_listed() -> None:
    for where in ("lft", "block.lft"):
        text = told(where, 0)
        assert all(name in text for name in ("left", "right", "bottom", "top", "surface"))
        assert "more" not in text
    assert "did you mean 'left'? known tags: " in told("lft", 0)


def test_of_many_the_first_ten_and_a_count() -> None:
    text = told("nothing-like-it", 20)
    names = text.partition("known tags: ")[2]
    listed, _, rest = names.partition(" and ")
    assert len(listed.split(", ")) == 10
    # 20 tags, 4 faces, the body, and all, surface, interior and ghosts.
    assert int(rest.split()[0]) == 20 + 4 + 1 + 4 - 10
    assert text.count("\n") == 1  # the cause, in one line


def test_a_face_of_a_load() -> None:
    scene = box(2).boundary("traction", where="interior", traction={"x": 1.0})
    with pytest.raises(BuildError, match="name a face: left, right, bottom, top"):
        scene.build()
