"""solidsph check: whether a part keeps its interface's promises."""

from __future__ import annotations

import click

from solidsph import registry
from solidsph.commands.console import say, show_json, show_table
from solidsph.commands.target import parameters
from solidsph.errors import SceneError


@click.command()
@click.argument("name", metavar="PLUGIN")
@click.option("--kind", help="Kind of part, where parts of several kinds have the name.")
@click.option("--set", "settings", multiple=True, metavar="NAME=VALUE", help="A part's parameter.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of a table.")
def check(name: str, kind: str | None, settings: tuple[str, ...], as_json: bool) -> None:
    """Certify a part by name: the conformance kit that every built-in part passes."""
    from solidsph.testing import conformance, example_part, kits

    found = _kind_of(name, kind)
    if found not in kits():
        raise SceneError(
            f"there is no conformance kit for a {registry.singular(found)}; kits exist for "
            f"{', '.join(registry.singular(one) for one in kits())}"
        )
    part = example_part(found, name, **parameters(settings))
    entry = registry.find(found, name)
    results = conformance(found, part)
    passed = all(result.passed for result in results)
    if as_json:
        show_json(
            {
                "part": name,
                "kind": registry.singular(found),
                "distribution": f"{entry.distribution} {entry.version}",
                "passed": passed,
                "checks": [
                    {
                        "check": result.name,
                        "passed": result.passed,
                        "measured": result.measured,
                        "required": result.required,
                    }
                    for result in results
                ],
            }
        )
    else:
        show_table(
            f"{registry.singular(found)} {name} ({entry.distribution} {entry.version}): {part}",
            ["check", "", "measured", "required"],
            [[r.name, "pass" if r.passed else "FAIL", r.measured, r.required] for r in results],
        )
        count = sum(not result.passed for result in results)
        say("certified" if passed else f"NOT certified: {count} of {len(results)} checks failed")
    if not passed:
        raise SystemExit(1)


def _kind_of(name: str, kind: str | None) -> str:
    kinds = [one for one in registry.INTERFACES if name in registry.names(one)]
    if kind is not None:
        wanted = [one for one in registry.INTERFACES if kind in (one, registry.singular(one))]
        if not wanted:
            known = ", ".join(registry.singular(one) for one in registry.INTERFACES)
            raise SceneError(f"unknown kind {kind!r}; known: {known}")
        registry.find(wanted[0], name)
        return wanted[0]
    if len(kinds) > 1:
        listed = ", ".join(registry.singular(one) for one in kinds)
        raise SceneError(f"{name!r} names parts of several kinds: {listed}; choose with --kind")
    if not kinds:
        everything = [known for one in registry.INTERFACES for known in registry.names(one)]
        import difflib

        near = difflib.get_close_matches(name, everything, 1)
        hint = f"did you mean {near[0]!r}?" if near else "list them: solidsph plugins"
        raise SceneError(f"no installed part is called {name!r}; {hint}")
    return kinds[0]
