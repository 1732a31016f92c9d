"""What the pages of this program share: templates, assets and the content security policy."""

from __future__ import annotations

import base64
import hashlib
import re
from importlib import resources

VIEWER_SCRIPTS = (
    "viewer_glb.js",
    "viewer_camera.js",
    "viewer_draw.js",
    "viewer.js",
    "viewer_input.js",
)
"""The 3D view, in the order in which a page needs them."""


def asset(name: str) -> str:
    """The text of a template, a style or a script of the report."""
    return resources.files("gelslim_cad.report").joinpath(name).read_text(encoding="utf-8")


def fill(template: str, values: dict[str, str]) -> str:
    """Replace every `{{name}}` once; a value may itself contain `{{`."""
    return re.sub(r"\{\{(\w+)\}\}", lambda found: values[found.group(1)], template)


def policy(style: str, script: str) -> str:
    """A content security policy that allows this style and this script and nothing else."""
    return (
        "default-src 'none'; img-src data:; base-uri 'none'; form-action 'none'; "
        f"style-src '{_digest(style)}'; script-src '{_digest(script)}'"
    )


def _digest(source: str) -> str:
    digest = hashlib.sha256(source.encode()).digest()
    return "sha256-" + base64.b64encode(digest).decode("ascii")
