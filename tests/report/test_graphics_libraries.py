"""Which Debian package a missing graphics library needs."""

from __future__ import annotations

import pytest

from gelslim_cad.pictures import graphics_libraries as graphics


@pytest.mark.parametrize(
    ("text", "library", "package"),
    [
        ("libGL.so.1: cannot open shared object file", "libGL", "libgl1"),
        ("libXrender.so.1: cannot open shared object file", "libXrender", "libxrender1"),
        ("No module named 'vtkmodules'", "", ""),
    ],
)
def test_the_reason_of_an_import_error_names_the_package(
    text: str, library: str, package: str
) -> None:
    assert graphics.package_named_in(text) == (library, package)


def test_needed_libraries_that_do_not_load_have_packages(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(graphics.sys, "platform", "linux")
    monkeypatch.setattr(graphics, "loads", lambda name: name != "libEGL.so.1")
    assert graphics.missing_graphics() == (("libEGL.so.1", "libegl1"),)
    monkeypatch.setattr(graphics, "loads", lambda name: False)
    assert all(package for _, package in graphics.missing_graphics())


def test_a_library_that_is_nowhere_does_not_load() -> None:
    assert not graphics.loads("libnowhere.so.1")
