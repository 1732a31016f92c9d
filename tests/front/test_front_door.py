"""`import gelslim` offers the public names and loads nothing heavy until one is used."""

from __future__ import annotations

import ast
import importlib
import inspect
import subprocess
import sys
from pathlib import Path

import pytest

import gelslim

ROOT = Path(__file__).parents[2]
HEAVY = ("numpy", "scipy", "numba", "pydantic", "cadquery", "OCP", "vtk", "matplotlib", "cv2")


def test_importing_the_front_door_loads_nothing_heavy() -> None:
    code = f"import sys, gelslim; print([m for m in {HEAVY!r} if m in sys.modules])"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT
    )
    assert done.stdout.strip() == "[]"


def test_measuring_a_force_loads_no_cad() -> None:
    names = ("open_frames", "load_bundle", "ForcePipeline", "calibrate")
    code = (
        f"import sys, gelslim; [getattr(gelslim, name) for name in {names!r}]; "
        "print([m for m in ('cadquery', 'OCP', 'vtk', 'gelslim_cad') if m in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT
    )
    assert done.stdout.strip() == "[]"


def test_every_public_name_exists() -> None:
    for name in gelslim.__all__:
        assert getattr(gelslim, name) is not None


def test_a_finger_from_the_front_door(tmp_path: Path) -> None:
    spec = gelslim.read_spec(ROOT / "designs" / "mini20.yaml")
    d = gelslim.derive(spec)
    assert gelslim.derive(ROOT / "designs" / "mini20.yaml").values == d.values
    assert 17 < d["finger.thickness_mm"] < 18
    assert all(c.status != "fail" for c in gelslim.check(spec))
    made = gelslim.make_bundle(spec, measure=False)
    gelslim.write_bundle(tmp_path / "bundle", made.bundle)
    assert gelslim.load_bundle(tmp_path / "bundle").geometry_hash == made.bundle.geometry_hash


@pytest.mark.slow
def test_a_plan_from_the_front_door() -> None:
    made = gelslim.plan(ROOT / "designs" / "scenes" / "press_sphere.yaml")
    effects = {choice.effect for choice in made.choices if choice.included}
    assert {"normal_contact", "perspective"} <= effects
    tight = gelslim.plan(
        gelslim.read_scene(ROOT / "designs" / "scenes" / "press_sphere.yaml"),
        gelslim.Budget(error=0.5),
    )
    assert len([c for c in tight.choices if c.included]) <= len(effects)


def test_errors_share_one_base() -> None:
    with pytest.raises(gelslim.GelslimError) as caught:
        gelslim.read_spec(ROOT / "designs" / "absent.yaml")
    assert caught.value.exit_status == 2
    assert caught.value.to_dict()["error"] == "bad input"


FACES = sorted(
    path.parent.relative_to(ROOT).as_posix().replace("/", ".")
    for root in ("gelslim", "gelslim_core", "gelslim_optics", "ifem_export", "gelslim_force")
    for path in [ROOT / root / "__init__.py"]
    if "__all__" in path.read_text(encoding="utf-8")
) + [
    root
    for root in ("gelslim_twin", "gelslim_cad")
    if "__all__" in (ROOT / root / "__init__.py").read_text(encoding="utf-8")
]


@pytest.mark.parametrize("package", FACES)
def test_a_package_lists_the_same_names_for_all_readers(package: str) -> None:
    """`__all__` agrees with the imports that type checkers and the loader read."""
    module = importlib.import_module(package)
    tree = ast.parse(Path(str(module.__file__)).read_text(encoding="utf-8"))
    typed = {
        alias.asname or alias.name
        for node in ast.walk(tree)
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test)
        for line in node.body
        if isinstance(line, ast.ImportFrom)
        for alias in line.names
    }
    assert typed == set(module.__all__) - {"__version__"}


def public(package: str) -> list[tuple[str, object]]:
    module = importlib.import_module(package)
    return [(name, getattr(module, name)) for name in module.__all__ if name != "__version__"]


@pytest.mark.parametrize("package", FACES)
def test_public_names_have_sections(package: str) -> None:
    """Google-style sections: arguments, results and errors of all that users call."""
    lacking = []
    for name, thing in public(package):
        text = inspect.getdoc(thing) or ""
        if inspect.isclass(thing):
            exempt = (
                issubclass(thing, Exception) or not text or getattr(thing, "_is_protocol", False)
            )
            needed = [] if exempt else ["Attributes:"] if "Args:" not in text else []
        elif callable(thing):
            given = [p for p in inspect.signature(thing).parameters if p not in ("self", "cls")]
            quiet = inspect.signature(thing).return_annotation in (None, "None")
            needed = ["Args:"] * bool(given) + ["Returns:"] * (not quiet)
            missing = [p for p in given if f"    {p}" not in text]
            lacking += [f"{name}: argument {p}" for p in missing]
        else:
            continue
        lacking += [f"{name}: {section}" for section in needed if section not in text]
        if not text:
            lacking.append(f"{name}: no docstring")
    assert lacking == []
