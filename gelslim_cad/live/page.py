"""The page that follows a design; it shares style and 3D view with the report."""

from __future__ import annotations

from importlib import resources

from gelslim_cad.report.markup import text
from gelslim_cad.report.page import VIEWER_SCRIPTS, asset, fill, policy


def live_page() -> bytes:
    """The page as UTF-8 HTML. It loads nothing but the events and solids of its own server."""
    style = asset("style.css") + _own("live.css")
    scripts = [*map(asset, VIEWER_SCRIPTS), _own("live.js")]
    script = "(() => {\n" + '"use strict";\n' + "\n".join(scripts) + "})();\n"
    viewer = fill(
        asset("viewer.html"), {"picture": "", "instead": "Rules and dimensions are shown below."}
    )
    page = fill(
        _own("live.html"),
        {
            "policy": text(policy(style, script) + "; connect-src 'self'"),
            "style": style,
            "viewer": viewer,
            "script": script,
        },
    )
    return page.encode()


def _own(name: str) -> str:
    return resources.files("gelslim_cad.live").joinpath(name).read_text(encoding="utf-8")
