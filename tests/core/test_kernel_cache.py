"""Cached kernels older than their helpers are dropped, others kept."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from gelslim_core.kernel_cache import drop_stale


@pytest.fixture
def package(tmp_path: Path) -> Path:
    cache = tmp_path / "__pycache__"
    cache.mkdir()
    for name, age in (("kernel.py", 200), ("helper.py", 100)):
        (tmp_path / name).write_text("")
        os.utime(tmp_path / name, (1000 - age, 1000 - age))
    for name in ("kernel.run-1.py311.nbi", "kernel.run-1.py311.1.nbc", "other.run-1.py311.nbi"):
        (cache / name).write_bytes(b"")
        os.utime(cache / name, (950, 950))
    return tmp_path


def names(package: Path) -> set[str]:
    return {p.name for p in (package / "__pycache__").iterdir()}


def test_a_fresh_cache_is_kept(package: Path) -> None:
    assert drop_stale(["kernel"], ["kernel", "helper"], package) == 0
    assert len(names(package)) == 3


def test_a_changed_helper_drops_the_kernels_cache_alone(package: Path) -> None:
    os.utime(package / "helper.py", (990, 990))
    assert drop_stale(["kernel"], ["kernel", "helper"], package) == 2
    assert names(package) == {"other.run-1.py311.nbi"}


def test_a_cache_folder_of_its_own_is_looked_at(
    package: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    os.utime(package / "helper.py", (990, 990))
    place = tmp_path / "numba" / "pkg_1"
    place.mkdir(parents=True)
    (place / "kernel.run-1.py311.nbi").write_bytes(b"")
    os.utime(place / "kernel.run-1.py311.nbi", (950, 950))
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "numba"))
    assert drop_stale(["kernel"], ["helper"], package) == 3
