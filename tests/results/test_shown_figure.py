"""Pictures of results show themselves in notebooks."""

from __future__ import annotations

from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from tests.helpers.scenes import box


@pytest.mark.parametrize("what", ["motion", "energy", "probes"])
def test_a_picture_shows_itself_without_pyplot(tmp_path, what: str) -> None:
    builder = box(2).probe(label="middle", quantity="velocity x", point=[0.5, 0.5])
    result = builder.duration(1e-3).build().run(record=tmp_path / "record.h5")
    made = Image.open(BytesIO(result.plot(what)._repr_png_()))
    assert made.format == "PNG"
    assert made.width > 500
    assert len(np.unique(np.asarray(made.convert("L")))) > 10  # something is drawn
