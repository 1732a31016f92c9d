"""One build that the tests of builds share."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path

import pytest

SPEC = Path(__file__).parents[2] / "designs" / "mini20.yaml"


@pytest.fixture(scope="session")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """designs/mini20.yaml, built; tests that change it work on a copy."""
    from gelslim_cad.build import build_variant

    folder = tmp_path_factory.mktemp("out") / "mini20"
    build_variant(SPEC, folder, jobs=1)
    return folder


@pytest.fixture(scope="session")
def digests() -> Callable[[Path], dict[str, str]]:
    """SHA-256 of every file below a folder."""

    def of(folder: Path) -> dict[str, str]:
        return {
            p.relative_to(folder).as_posix(): hashlib.sha256(p.read_bytes()).hexdigest()
            for p in sorted(folder.rglob("*"))
            if p.is_file()
        }

    return of
