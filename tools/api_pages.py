"""Write one page of the API reference for each package, from the names of its `__all__`."""

from __future__ import annotations

import argparse
import importlib
import inspect
from pathlib import Path

PACKAGES = (
    "gelslim", "gelslim_force", "gelslim_twin", "gelslim_cad", "ifem_export", "gelslim_optics",
    "gelslim_core",
)  # fmt: skip


def page(package: str) -> str:
    """The page of one package: its docstring, then each public name."""
    module = importlib.import_module(package)
    lines = [f"# `{package}`", "", inspect.getdoc(module) or "", ""]
    for name in getattr(module, "__all__", ()):
        if name.startswith("__"):
            continue
        thing = getattr(module, name)
        kind = "class" if inspect.isclass(thing) else "function" if callable(thing) else "data"
        kind = "exception" if kind == "class" and issubclass(thing, Exception) else kind
        options = [":members:", ":show-inheritance:"] if kind in ("class", "exception") else []
        lines += ["```{eval-rst}", f".. auto{kind}:: {package}.{name}"]
        lines += [f"   {option}" for option in options]
        lines += ["```", ""]
    return "\n".join(lines)


def main(folder: Path) -> None:
    """Write the pages and their index into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    found = [p for p in PACKAGES if hasattr(importlib.import_module(p), "__all__")]
    for package in found:
        (folder / f"{package}.md").write_text(page(package), encoding="utf-8")
    entries = "\n".join(found)
    (folder / "index.md").write_text(
        "# Public names\n\nWhat these packages offer to others. Anything else may change.\n\n"
        f"```{{toctree}}\n:maxdepth: 1\n\n{entries}\n```\n",
        encoding="utf-8",
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="folder to write the pages to")
    main(parser.parse_args().folder)
