"""The same part gives the same bytes: in any process, in any order, after anybody else."""

from __future__ import annotations

import json
import multiprocessing
import os
import re
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import export_digests
import export_samples as samples
import pytest

import gelslim_cad
from gelslim_cad.export import ExportError
from gelslim_cad.export.brep import shape_digest, shape_from_bytes, shape_to_bytes
from gelslim_cad.export.step import step_bytes

ROOT = Path(gelslim_cad.__file__).parent.parent


def fresh_process(order: tuple[str, ...], hash_seed: str) -> dict[str, str]:
    paths = os.pathsep.join([str(ROOT), str(Path(__file__).parent)])
    environment = os.environ | {"PYTHONPATH": paths, "PYTHONHASHSEED": hash_seed}
    script = Path(export_digests.__file__)
    done = subprocess.run(
        [sys.executable, str(script), *order],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    return dict(json.loads(done.stdout))


@pytest.fixture(scope="module")
def here() -> dict[str, str]:
    return export_digests.digests(export_digests.NAMES)


@pytest.mark.slow
def test_every_file_is_the_same_in_fresh_processes_and_in_another_order(here):
    backwards = fresh_process(export_digests.NAMES[::-1], "1")
    assert backwards == here
    assert fresh_process(("window", "busy", "plate", "dimple"), "2") == here
    assert len(set(here.values())) == len(here)


@pytest.mark.slow
def test_repeating_in_one_process_changes_nothing(here):
    assert export_digests.digests(export_digests.NAMES[::-1]) == here


def test_step_ignores_and_keeps_settings_others_left_behind():
    from OCP.Interface import Interface_Static

    part = samples.part("window", samples.window())
    expected = step_bytes(part)
    old_unit = Interface_Static.CVal_s("write.step.unit")
    old_mode = Interface_Static.IVal_s("write.surfacecurve.mode")
    try:
        Interface_Static.SetCVal_s("write.step.unit", "INCH")
        Interface_Static.SetIVal_s("write.surfacecurve.mode", 0)
        assert step_bytes(part) == expected
        assert Interface_Static.CVal_s("write.step.unit") == "INCH"
        assert Interface_Static.IVal_s("write.surfacecurve.mode") == 0
    finally:
        Interface_Static.SetCVal_s("write.step.unit", old_unit)
        Interface_Static.SetIVal_s("write.surfacecurve.mode", old_mode)


def test_reals_are_rounded_and_names_that_look_like_reals_are_not():
    name = "it's (1.234567890123, -0.) in 2.5E-13"
    third = samples.box(1 / 3, 2 / 3, 1.0, at=(1e-13, 0.0, 0.0))
    text = step_bytes(samples.part(name, third)).decode("ascii")
    assert text.count(name.replace("'", "''")) >= 2
    values = re.findall(r"-?\d+\.\d*(?:E[+-]?\d+)?", re.sub(r"'(?:[^']|'')*'", "", text))
    assert {"0.1666666667", "0.3333333333", "0."} <= set(values)
    assert not any(v == "-0." or "E" in v for v in values)
    assert max(len(v.partition(".")[2]) for v in values) == 10


@pytest.mark.parametrize("name", sorted(samples.SHAPES))
def test_shapes_survive_as_bytes(name):
    shape = samples.SHAPES[name]()
    again = shape_from_bytes(shape_to_bytes(shape))
    assert shape_digest(again) == shape_digest(shape)
    assert again.Volume() == pytest.approx(shape.Volume(), rel=1e-14)


def test_digest_ignores_use_and_sees_change():
    shape = samples.drilled_plate()
    before = shape_digest(shape)
    shape.isValid()
    shape.tessellate(0.01)
    shape.BoundingBox()
    assert shape_digest(shape) == before
    assert shape_digest(samples.box(1, 1, 1)) != shape_digest(samples.box(1, 1, 1.000001))


@pytest.mark.parametrize("data", [b"", b"nothing of the kind"])
def test_bytes_without_a_shape_are_refused(data):
    with pytest.raises(ExportError):
        shape_from_bytes(data)


def test_truncated_bytes_are_refused():
    with pytest.raises(ExportError):
        shape_from_bytes(shape_to_bytes(samples.window())[:3000])


def volume_in_worker(data: bytes) -> tuple[float, str]:
    shape = shape_from_bytes(data)
    return shape.Volume(), shape_digest(shape)


@pytest.mark.slow
def test_shapes_travel_to_a_spawned_worker():
    shape = samples.window()
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=context) as pool:
        volume, digest = pool.submit(volume_in_worker, shape_to_bytes(shape)).result()
    assert volume == pytest.approx(samples.window_volume_mm3(), rel=1e-12)
    assert digest == shape_digest(shape)
