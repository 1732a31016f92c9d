"""A description of a sensor to start from; schema and reference page of such files."""

from __future__ import annotations

from gelslim_core.yaml.reader import load_bytes
from gelslim_core.yaml.schema import reference_markdown
from gelslim_core.yaml.schema import schema_text as model_schema
from gelslim_force.imported.description import FORMAT, SensorDescription

SCHEMA_FILE = "gelslim-sensor-1.schema.json"
"""Usual name of the schema's file."""
RULES = (
    ("gel", "corner_radius_mm is at most half the shorter side"),
    ("markers", "pitch_mm is given unless view has points, a homography or a pinhole"),
    ("markers", "pitch_across_mm needs pitch_mm; diameters_px are smallest and largest"),
    ("view", "at most one of points, homography and pinhole; gel_middle_px with none of them"),
    ("view", "points are at least four, and not on one line"),
    ("lens", "at most one of focal_px, field_of_view_deg and intrinsics; a pinhole needs one"),
)
"""Rules between fields, by their block."""
_HEAD = """\
# Sensor reference

<!-- Made by `make docs` from the schema; do not edit by hand. -->

Every field of the description of a sensor that was not generated here (`format: gelslim-sensor/1`).
[Other sensors](other_sensors.md) is the guide. `gelslim schema --sensor` prints the JSON Schema,
which is also in [gelslim-sensor-1.schema.json](gelslim-sensor-1.schema.json).
"""
_BETWEEN = """
## Rules between fields

"""
_TEXT = """\
## A marker sensor that was not generated here. All sizes in the unit that ends the name.
## What is not given takes its default, shown behind "# ", and the import says what it assumed;
## to change a value, delete the "# " in front of it and of its block. Lines with "##" are remarks.
format: gelslim-sensor/1
name: {name}
gel:
  length_mm: 24                          ## along x
  width_mm: 18                           ## along y
  thickness_mm: 3
  # corner_radius_mm: 0
  # thickness_tolerance_mm: 0.2          ## standard deviation
  # youngs_modulus_mpa: 0.2              ## forces are proportional to it
  # youngs_modulus_tolerance_ratio: 0.5  ## standard deviation, as a part of it
  # poissons_ratio: 0.48
  # poissons_ratio_tolerance: 0.01
  # density_kg_m3: 1000
  # refractive_index: 1.41
markers:
  pitch_mm: 1.5                          ## measure over many dots and divide
  # pitch_across_mm: 1.5                 ## along y, where it differs
  # diameters_px: [6, 20]                ## smallest and largest dot; estimated where left out
view:
  reference: reference.png               ## a picture without contact, or a folder of several
  # x_points: right                      ## right, down, left or up: where x points in the picture
  # mirrored: false                      ## true over one mirror: the gel as seen from outside
  # gel_middle_px: [320, 240]            ## by default the middle of the dots
  # scale_tolerance_ratio: 0.01          ## standard deviation of the pitch, or of the points
  ## One of these says more than the pitch alone:
  # points:                              ## at least four points of the gel, such as its corners
  #   - {{gel_mm: [-12, -9], picture_px: [60, 45]}}
  #   - {{gel_mm: [12, -9], picture_px: [580, 45]}}
  #   - {{gel_mm: [12, 9], picture_px: [580, 435]}}
  #   - {{gel_mm: [-12, 9], picture_px: [60, 435]}}
  # homography: [[21.6, 0, 320], [0, 21.6, 240], [0, 0, 1]]   ## from x, y in mm to px
  # pinhole: {{position_mm: [0, 0, -25], looks_at_mm: [0, 0]}}
# lens:                                  ## one of the first three; where none, it is estimated
#   focal_px: 550
#   field_of_view_deg: 60                ## across the width of the picture
#   intrinsics: camera.yaml              ## of ROS or OpenCV
#   focal_tolerance_ratio: 0.03
# windows:                               ## plates from the camera to the gel
#   - {{thickness_mm: 2, index: 1.49}}
"""


def starter_text(name: str) -> str:
    """A description called `name`: required fields filled in, all others as comments.

    Raises InputError for a name that a file or folder cannot have.
    """
    text = _TEXT.format(name=name)
    load_bytes("starter", text.encode(), SensorDescription)
    return text


def schema_text() -> str:
    """The JSON Schema of descriptions."""
    return model_schema(SensorDescription, FORMAT)


def reference_text() -> str:
    """The page with every field in Markdown, the same for the same program."""
    rules = "".join(f"- `{block}`: {rule}.\n" for block, rule in RULES)
    return f"{_HEAD}\n{reference_markdown(SensorDescription)}{_BETWEEN}{rules}"
