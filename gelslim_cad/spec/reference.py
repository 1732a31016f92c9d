"""The JSON Schema of the spec, for editors, and the reference page made from it."""

from __future__ import annotations

import gelslim_core.yaml.schema
from gelslim_cad.spec.spec import Spec
from gelslim_core.yaml.schema import reference_markdown

RULES = (
    ("camera", "`model` names a camera of the library, or all required fields are given"),
    ("camera", "`mode` needs `model`, and names one of its modes"),
    (
        "camera",
        "`image_height_px` is at most `image_width_px`, the wider axis lying across the finger; "
        "`orientation: portrait` has it along the finger, and `image_height_px` above",
    ),
    ("camera", "pixels are square: picture and sensor have the same proportions within 2 %"),
    (
        "camera",
        "a field of view that is given agrees with sensor, focal length and distortion within 5 %",
    ),
    ("camera", "`lens_diameter_mm` is at most `module_width_mm`"),
    ("camera", "`distortion` is one-to-one up to the corner of the sensor"),
    ("camera.distortion", "`k4` belongs to `kannala_brandt`, `p1` and `p2` to `brown`"),
    ("camera.distortion", "`tv_percent` is given without coefficients, for `brown`"),
    ("design.gel", "`corner_radius_mm` is at most half of the shorter side"),
    ("design.leds", "`emission: table` has two or more angles, as many intensities, rising from 0"),
    ("design.leds", "`one_wavelength_nm` and a `light` of colours exclude each other"),
    ("design.markers", "`rows` and `columns`, where given, fit on the gel at `pitch_mm`"),
    ("design.markers", "`diameter_mm` is below `pitch_mm`, else dots merge"),
    ("parts", "each names a `.step` file, or a `.py` file and a function after a colon"),
    ("material.gel", "`youngs_modulus_mpa` is at most 5 unless `material.allow_stiff_gel: true`"),
    ("electronics", "the five `own_` fields are given together or not at all"),
    ("electronics", "`own_forward_v` has two voltages between 0.5 and 10 V"),
    ("mesh", "`cells_along` and `cells_across` are given together or not at all"),
)
"""What no single field can tell: block, rule. The reader enforces each."""

_HEAD = """\
# Spec reference

<!-- Made by `make docs` from the schema; do not edit by hand. -->

Every field of a spec (`format: gelslim-spec/1`), block by block in the order of the file. The unit
is the last part of a name. *None* means that the value is derived, or that there is no limit;
`null` may be written. Unknown names are refused with the nearest known one. `gelslim new` writes a
spec with all of this as comments; `gelslim schema` prints the JSON Schema, which is also in
[gelslim-spec-1.schema.json](gelslim-spec-1.schema.json).

What each field does to the finger: [design guide](design_guide.md).
"""
_BETWEEN = """
## Rules between fields

Checked when the file is read. Whether the finger can be *built* is another question, which
`gelslim check` answers.

"""


def reference_text() -> str:
    """The whole page in Markdown, the same for the same program."""
    rules = "".join(f"- `{block}`: {rule}.\n" for block, rule in RULES)
    return f"{_HEAD}\n{reference_markdown(Spec)}{_BETWEEN}{rules}"


FORMAT = "gelslim-spec/1"


def schema_text() -> str:
    """The JSON Schema (draft 2020-12) of the spec as text, the same for the same program."""
    return gelslim_core.yaml.schema.schema_text(Spec, FORMAT)
