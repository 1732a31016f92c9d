"""What people ask a spec for and what is not supported: answered plainly, without a guess."""

from __future__ import annotations

from gelslim_core.yaml.base import Unsupported

UNSUPPORTED: tuple[Unsupported, ...] = (
    Unsupported(
        r"^(design\.)?mirror(\.(kind|type|use|enabled))?: (none|no|false|off)$"
        r"|mirror_?less|(no|without)_mirror|straight_?down|looks?_?down"
        r"|\.(layout|placement|view): .*(straight|direct|down|below|behind)",
        "a camera that looks straight onto the gel, without the fold mirror,",
    ),
    Unsupported(
        r"gel\.(\w+: )?\w*(dome|hemispher|spher|cylind|finger_?tip|round_?tip|curved)",
        "a gel that is no pad, flat or with a low crown,",
    ),
    Unsupported(
        r"design\.(leds|lights?)(\w*\.)?\w*(rgb|third|three|four|ring|proximal|rear|near_end)"
        r"|leds\.\w*: .*rgb|leds\.\w*(colou?rs?|lights?|sides?|strips?): "
        r".*(\b[34]\b|three|four|red.*green.*blue)",
        "a fourth strip, or several colours in one strip,",
        "three colours have a strip each: two of them are design.leds.light, and the third, at the "
        "tip, is design.leds.tip",
    ),
    Unsupported(r"leds\.(\w+: )?(\w+_)?(ultra_?violet|uva?)(_|:|$)", "ultraviolet light"),
    Unsupported(
        r"leds\.(\w+: )?(\w+_)?(infra_?red|n?ir)(_|:|$)",
        "infrared light under this name",
        "both strips have one wavelength then: design.leds.one_wavelength_nm, for a mono camera "
        "without infrared filter",
    ),
    Unsupported(
        r"markers(\.(pattern|layout|shape|kind|type|grid|arrangement))?: \[?\w*(random|hex|triang"
        r"|speckle|scatter|stagger|line|circle|ring|square|fiducial|aruco|april|cross|voronoi)",
        "any marker pattern but a regular grid of dots",
    ),
    Unsupported(
        r"^parts\.(light_guide|gel(_pad)?|mirror|led_board\w*|camera|window)\b",
        "an own part in place of one that the light is traced through, the mould is cast for or "
        "that is bought,",
    ),
    Unsupported(
        r"^cameras|camera\.(count|number)|(stereo|second|two|depth|event)_?camera"
        r"|camera\.(kind|type|technology): .*(event|depth|stereo|tof|thermal)",
        "another camera than a single one that takes pictures",
    ),
)
"""The first whose pattern fits an unknown field or an illegal value is told."""
