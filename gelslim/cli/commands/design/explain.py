"""`gelslim explain`: where one value comes from."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gelslim.cli.answer import console, given, number, print_json
from gelslim.cli.failure import CommandError
from gelslim.cli.options import AsJson, SpecFile

if TYPE_CHECKING:
    from rich.text import Text
    from rich.tree import Tree

    from gelslim_cad.checks.explain import Node


def explain(
    spec: SpecFile,
    name: Annotated[
        str,
        typer.Argument(
            metavar="NAME",
            help="A dimension (finger.thickness_mm), a rule (blur.gel) or a field of the spec.",
        ),
    ],
    as_json: AsJson = False,
) -> int:
    """Print where a value comes from.

    Shows the formulas with their numbers, back to the lines of the spec.
    """
    from gelslim_cad.checks.explain import UnknownNameError
    from gelslim_cad.checks.explain import explain as trace
    from gelslim_cad.dimensions import derive
    from gelslim_cad.tolerance.asked import read_spec

    loaded = read_spec(spec)
    try:
        root = trace(loaded, derive(loaded.spec), name)
    except UnknownNameError as error:
        raise CommandError(f"gelslim explain: {error}") from None
    if as_json:
        print_json({"format": "gelslim-explanation/1", "spec": loaded.path, **_record(root)})
    else:
        console().print(_tree(root))
    return 0


def _record(node: Node) -> dict[str, Any]:
    record = asdict(node)
    record["inputs"] = [_record(child) for child in node.inputs]
    return record


def _tree(node: Node) -> Tree:
    from rich.tree import Tree

    label = _label(node)
    label.append(f"\n{node.meaning.rstrip('.')}.", style="not bold")
    if node.kind == "field" and node.note:
        label.append(f"\n{node.note}", style="not bold")
    tree = Tree(label, guide_style="dim")
    _grow(tree, node)
    return tree


def _grow(tree: Tree, node: Node) -> None:
    for child in node.inputs:
        _grow(tree.add(_label(child)), child)


def _label(node: Node) -> Text:
    from rich.text import Text

    shown = given if node.kind == "field" else number
    text = Text(node.name, style="bold")
    if node.value is not None or node.kind == "field":
        text.append(f" = {shown(node.value, node.unit)}", style="not bold")
    if node.repeated:
        text.append("  (see above)", style="not bold dim")
        return text
    if node.origin:
        text.append(f"  {node.origin}", style="not bold cyan")
        return text
    if node.formula:
        text.append(f"\n{node.formula}", style="not bold italic")
    if node.note:
        text.append(f"\n{node.note}", style="not bold")
    if node.source:
        text.append(f"  [{node.source}]", style="not bold dim")
    return text
