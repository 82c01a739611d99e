"""What the pages of the documentation hold: contents, links, headings, cells."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path, PurePosixPath

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"

PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md", *DOCS.rglob("*.md")]
TUTORIALS = sorted(page for page in (DOCS / "tutorials").glob("*.md") if page.stem != "index")

_FENCE = re.compile(r"^(`{3,}).*?^\1$", flags=re.MULTILINE | re.DOTALL)


def text_of(page: Path) -> str:
    """The text of a page without its blocks of code."""
    return _FENCE.sub("", page.read_text(encoding="utf-8"))


def links(page: Path) -> Sequence[str]:
    """Targets of its links and pictures."""
    words = re.sub(r"`[^`]*`(?!\])", "", text_of(page))  # code may look like a link
    return re.findall(r"\]\(([^)\s]+)\)", words)


def anchors(page: Path) -> set[str]:
    """Anchors that GitHub and the site give to its headings."""
    headings = re.findall(r"^#+ (.*)$", text_of(page), flags=re.MULTILINE)
    plain = [re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading) for heading in headings]
    return {re.sub(r"[^\w\- ]", "", h.strip().lower()).replace(" ", "-") for h in plain}


def reached() -> set[str]:
    """Pages that the contents lead to, from the first one on."""
    found: set[str] = set()
    left = ["index"]
    while left:
        page = left.pop()
        if page in found:
            continue
        found.add(page)
        text = (DOCS / f"{page}.md").read_text(encoding="utf-8")
        for block in re.findall(r"```\{toctree\}\n(.*?)```", text, flags=re.DOTALL):
            entries = [line for line in block.split("\n") if line and not line.startswith(":")]
            left += [str(PurePosixPath(page).parent / entry) for entry in entries]
    return found


def cells(page: Path) -> Sequence[str]:
    """The Python of a tutorial, without what only a notebook understands."""
    text = page.read_text(encoding="utf-8")
    found = re.findall(r"```\{code-cell\} python\n(.*?)^```", text, flags=re.MULTILINE | re.DOTALL)
    other = ("%%bash", "%%writefile pyproject")
    python = [cell for cell in found if not cell.startswith(other)]
    return [re.sub(r"^%%.*$", "", cell, flags=re.MULTILINE) for cell in python]
