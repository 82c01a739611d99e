"""Directive that shows what every verb of the command line says of itself."""

from __future__ import annotations

import click
from docutils import nodes
from docutils.statemachine import StringList
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from solidsph.cli import VERBS, cli

_WIDTH = 80


class CommandLine(SphinxDirective):
    """`{command-line}`: a section for each verb, with its help."""

    def run(self) -> list[nodes.Node]:
        lines: list[str] = []
        with click.Context(cli, info_name="solidsph") as parent:
            for verb in VERBS:
                command = cli.get_command(parent, verb)
                assert command is not None
                context = click.Context(
                    command, info_name=verb, parent=parent, terminal_width=_WIDTH
                )
                lines += [f"## {verb}", "", "```text", *command.get_help(context).splitlines()]
                lines += ["```", ""]
        return self.parse_text_to_nodes(
            StringList(lines, source=self.env.docname), allow_section_headings=True
        )


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_directive("command-line", CommandLine)
    return {"parallel_read_safe": True}
