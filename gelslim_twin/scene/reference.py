"""The reference page of scenes, made from their schema."""

from __future__ import annotations

from gelslim_core.yaml.schema import reference_markdown
from gelslim_twin.scene.scene import Scene

RULES = (
    ("sensor", "names `spec` or `bundle`, not both"),
    ("indenters[]: ring", "`inner_radius_mm` is below `outer_radius_mm`"),
    ("indenters[]: flat_punch", "`radius_mm`, or `length_mm` and `width_mm`, not both kinds"),
    ("motion", "`waypoints` or `csv`, not both; a table gives the place, so no start beside it"),
    ("motion", "at most 20 000 poses"),
    ("observe", "nothing is listed twice"),
    (
        "vary",
        "the first value of a range is at most the second; factors of depth and size are above 0",
    ),
)
"""What no single field can tell: block, rule. The reader enforces each."""

_HEAD = """\
# Scene reference

<!-- Made by `make docs` from the schema; do not edit by hand. -->

Every field of a contact scene (`format: gelslim-scene/1`), block by block in the order of the file.
What scenes are for, and how effects are chosen, is in the [digital twin's guide](digital_twin.md).
`gelslim schema --scene` prints the JSON Schema, which is also in
[gelslim-scene-1.schema.json](gelslim-scene-1.schema.json).
"""
_BETWEEN = """
## Rules between fields

Checked when the file is read.

"""


def reference_text() -> str:
    """The whole page in Markdown, the same for the same program."""
    rules = "".join(f"- `{block}`: {rule}.\n" for block, rule in RULES)
    return f"{_HEAD}\n{reference_markdown(Scene)}{_BETWEEN}{rules}"
