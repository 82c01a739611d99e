"""Directive that documents every built-in part of a kind, as the registry lists them."""

from __future__ import annotations

from docutils import nodes
from docutils.statemachine import StringList
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from solidsph.registry import registry

OWN = "solidsph"


class RegisteredParts(SphinxDirective):
    """`{registered-parts} kernels`: a section for each, with its name in scenes and its class."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        (kind,) = self.arguments
        lines: list[str] = []
        for entry in registry.available(kind):
            if entry.distribution == OWN:
                lines += [*self._described(entry), ""]
        return self.parse_text_to_nodes(
            StringList(lines, source=self.env.docname), allow_section_headings=True
        )

    def _described(self, entry: registry.Entry) -> list[str]:
        """In the language of the page: MyST."""
        target = entry.target.replace(":", ".")
        return [
            f"### {entry.name}",
            "",
            "```{eval-rst}",
            f".. autoclass:: {target}",
            "   :no-members:",
            "```",
        ]


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_directive("registered-parts", RegisteredParts)
    return {"parallel_read_safe": True}
