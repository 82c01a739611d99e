"""Docstrings as the code has them: plain text, Google's sections, comments behind fields."""

from __future__ import annotations

import ast
import inspect
import io
import re
import sys
import textwrap
import tokenize
from collections.abc import Mapping
from typing import Any

import attrs
from sphinx.application import Sphinx
from sphinx.ext.napoleon import Config, GoogleDocstring

_SECTIONS = Config(napoleon_numpy_docstring=False)
_WITH_SECTIONS = {"class", "exception", "function", "method", "module"}

_ALIAS = re.compile(r"TypeAliasForwardRef\('([^']+)'\)")


def _read(app: Sphinx, what: str, name: str, obj: Any, options: object, lines: list[str]) -> None:
    """Turn a docstring into reStructuredText."""
    lines[:] = _as_text(lines)
    if what in _WITH_SECTIONS:
        lines[:] = GoogleDocstring(lines, _SECTIONS, app, what, name, obj, options).lines()
    if what == "class" and attrs.has(obj):
        lines += ["", *(f":param {field}: {text}" for field, text in _comments(obj).items()), ""]


def _as_text(lines: list[str]) -> list[str]:
    """The same in reStructuredText; formulas on lines of their own stay as they are."""
    made: list[str] = []
    last, is_formula = "", False  # last line that is not empty
    for line in lines:
        is_indented = line.startswith("    ")
        if line and not is_indented:
            is_formula = False
        elif is_indented and made[-1:] != [last] and last and not last.startswith(" "):
            made += ["::", ""]
            is_formula = True
        made.append(line if is_formula else _quoted(line))
        last = made[-1] if line else last
    return made


def _quoted(line: str) -> str:
    """Keep formulas from being read as mark-up."""
    found = re.match(r"(\s*(?:\* )?)(.*)", line)
    assert found is not None
    pieces = re.split(r"(`+[^`]*`+)", found[2])
    pieces[::2] = [re.sub(r"[*|]|_(?!\w)", r"\\\g<0>", piece) for piece in pieces[::2]]
    return found[1] + "".join(pieces)


def _comments(cls: type[Any]) -> Mapping[str, str]:
    """What stands behind the fields of a class: units, shapes and meanings."""
    known: dict[str, str] = {}
    for base in reversed(cls.__mro__):
        if attrs.has(base):
            known |= _own_comments(base)
    fields = [field.alias or field.name for field in attrs.fields(cls) if field.init]
    return {name: _quoted(known[name]) for name in fields if name in known}


def _own_comments(cls: type[Any]) -> Mapping[str, str]:
    source = textwrap.dedent(inspect.getsource(cls))
    comments = {
        token.start[0]: token.string.lstrip("# ")
        for token in tokenize.generate_tokens(io.StringIO(source).readline)
        if token.type == tokenize.COMMENT
    }
    (body,) = ast.parse(source).body
    assert isinstance(body, ast.ClassDef)
    return {
        node.target.id: comments[node.end_lineno]
        for node in body.body
        if isinstance(node, ast.AnnAssign)
        and isinstance(node.target, ast.Name)
        and node.end_lineno in comments
    }


def _annotate(app: Sphinx, obj: Any, bound: bool) -> None:
    """Give the fields of a class their own types, where a converter would take anything."""
    owner: Any = sys.modules.get(getattr(obj, "__module__", None) or "")
    for part in getattr(obj, "__qualname__", "").split(".")[:-1]:
        owner = getattr(owner, part, None)
    if isinstance(owner, type) and attrs.has(owner) and obj.__name__ == "__init__":
        types = {field.alias or field.name: field.type for field in attrs.fields(owner)}
        obj.__annotations__ |= {k: types[k] for k in obj.__annotations__ if types.get(k)}


def _named(
    app: Sphinx, what: str, name: str, obj: Any, options: object, signature: str, returned: str
) -> tuple[str | None, str | None]:
    """Names of types in place of how Sphinx keeps them in unions."""
    return (
        signature and _ALIAS.sub(r"\1", signature),
        returned and _ALIAS.sub(r"\1", returned),
    )


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("autodoc-process-docstring", _read)
    app.connect("autodoc-before-process-signature", _annotate)
    app.connect("autodoc-process-signature", _named)
    return {"parallel_read_safe": True}
