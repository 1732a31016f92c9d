"""The designs and scenes that come with the program."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from gelslim_core.errors import GelslimError

_HERE = Path(__file__).parent
_FOLDERS = (_HERE / "designs", _HERE.parent / "designs")
"""In an installed package, and in a checkout."""


class ExampleError(GelslimError, ValueError):
    """There is no example of that name, or the examples are not installed."""


@dataclass(frozen=True)
class Example:
    """A design or a scene that comes with the program.

    Attributes:
        name: Name for `gelslim new --from`.
        kind: `design` or `scene`.
        path: The YAML file.
        summary: First sentence of the comment at the beginning of the file.
    """

    name: str
    kind: str
    path: Path
    summary: str

    def files(self, name: str) -> dict[str, str]:
        """Return copies of the example under another name.

        Args:
            name: The name in the new file; it also names the file.

        Returns:
            Text by file name: the example, and the files that a scene refers to, with the
            references changed to files in the same folder.
        """
        text = re.sub(r"(?m)^name:.*$", f"name: {name}", self.path.read_text(encoding="utf-8"))
        found: dict[str, str] = {}
        for field, target in re.findall(r"(?m)^\s*(spec|csv|stl):[ \t]*([^\s#]+)", text):
            source = self.path.parent / target
            if self.kind == "scene" and source.is_file():
                found[source.name] = source.read_text(encoding="utf-8")
                text = text.replace(f"{field}: {target}", f"{field}: {source.name}")
        return {f"{name}.yaml": text, **found}


def examples() -> tuple[Example, ...]:
    """List the designs and scenes that come with the program.

    Returns:
        The examples, designs first.

    Raises:
        ExampleError: The examples are not installed.
    """
    folder = next((f for f in _FOLDERS if f.is_dir()), None)
    if folder is None:
        raise ExampleError(
            f"the examples are missing from {_FOLDERS[0]}; install gelslim-cad again"
        )
    places = (("design", folder), ("scene", folder / "scenes"))
    return tuple(
        Example(path.stem, kind, path, _summary(path.read_text(encoding="utf-8")))
        for kind, place in places
        for path in sorted(place.glob("*.yaml"))
    )


def example(name: str) -> Example:
    """Find the example of a name.

    Raises:
        ExampleError: No example has this name.
    """
    found = {entry.name: entry for entry in examples()}
    if name not in found:
        raise ExampleError(f"no example is called {name}; choose one of {', '.join(found)}")
    return found[name]


def _summary(text: str) -> str:
    """Return the first sentence of the comment at the beginning of a file."""
    remark: list[str] = []
    for line in text.splitlines():
        if not line.startswith("#") or not line.strip("# "):
            break
        remark.append(line.strip("# "))
    return re.split(r"(?<=[.:]) ", " ".join(remark))[0].rstrip(":.")
