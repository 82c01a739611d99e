"""How `make docs` builds the site: Sphinx, pages in MyST Markdown, tutorials run by MyST-NB."""

import os
import re
import sys
from importlib.metadata import version as installed
from pathlib import Path

from sphinx.application import Sphinx

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE / "_ext"))
# Tutorials call commands of the environment that the site is built in.
os.environ["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])

project = "solidsph"
author = "The solidsph developers"
copyright = "The solidsph developers, MIT licence"
version = release = installed("solidsph")

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.viewcode",
    "sphinx_copybutton",
    "drawn_math",
    "plain_docstrings",
    "registered_parts",
    "command_line",
]
exclude_patterns = ["_ext", "_static"]
nitpicky = True

# Types that appear in signatures and are not for users.
INTERNAL = "|".join(
    rf"solidsph\.{name}"
    for name in (
        r"assembly\.builder\.Builder",
        r"interfaces\.part\.Part",
        r"results\.(contents|time_series)\.\w+",
        r"registry\.registry\.Entry",
        r"run\.restart_point\.RestartPoint",
        r"errors\.PortableError",
        r"model\.neighbours\.Hidden",
        r"model\.surface\.Pieces",
        r"scene\.scene_data\.\w+",
        r"studies\.(reference\.Reference|quantity\.Quantity|case\.Picture)",
        r"studies\.(runner\.Runner|sweep\.SweepStatus)",
    )
)

# Pages.
myst_enable_extensions = ["colon_fence", "deflist", "dollarmath", "amsmath"]
myst_heading_anchors = 3  # as GitHub makes them, so that links to sections work in both
suppress_warnings = [
    "myst.header",  # pages that a command writes skip a level
    "ref.python",  # a type whose name some attribute has too
]

# Tutorials are run at every build; one that raises fails it.
nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 120
nb_execution_in_temp = True
nb_merge_streams = True

# The reference.
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_default_options = {"members": True, "show-inheritance": True}
autodoc_type_aliases = {
    name: f"solidsph.parts.{name}"
    for name in ("Array", "Indices", "Mask", "Scalar", "Tensor", "Vector", "Component", "Where")
}
python_use_unqualified_type_names = True
maximum_signature_line_length = 88
default_role = "code"  # single backticks in docstrings
# A type of another library, or one that only the core handles, has no page here.
nitpick_ignore_regex = [(r"py:.*", r"(?!solidsph)[\s\S]*"), (r"py:class", INTERNAL)]

# The look.
html_theme = "furo"
html_math_renderer = "drawn"
html_title = f"solidsph {version}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_sourcelink = False

# Files beside this folder have a page here; GitHub reads the links as they are.
BESIDE = {"CHANGELOG": "changelog", "CONTRIBUTING": "contributing", "README": "index"}


def _link_pages(app: Sphinx, docname: str, source: list[str]) -> None:
    """Turn links to files beside this folder into links to their pages."""
    source[0] = re.sub(
        r"\]\(\.\./(CHANGELOG|CONTRIBUTING|README)\.md",
        lambda found: f"]({BESIDE[found[1]]}.md",
        source[0],
    )


def setup(app: Sphinx) -> None:
    app.connect("source-read", _link_pages)
