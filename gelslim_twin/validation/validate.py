"""Frames of standard contacts with known forces, through the pipeline, error by error.

The truth is a pad of eight layers under Coulomb friction; its frames are drawn with everything a
real sensor shows. The pipeline has the sensor's own bundle and a reference frame, nothing else.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_force.calibration import calibrate
from gelslim_force.force_pipeline import ForcePipeline
from gelslim_force.frame_result import FrameResult
from gelslim_force.sensor_calibration import SensorCalibration
from gelslim_twin.contact.compliance import SurfaceCompliance
from gelslim_twin.contact.solver import ContactSettings, ContactSolver
from gelslim_twin.contact.tool import Tool
from gelslim_twin.render.frame_renderer import FrameRenderer
from gelslim_twin.render.sensor_look import sensor_look
from gelslim_twin.render.surface_state import SurfaceState
from gelslim_twin.render.surroundings import Pad
from gelslim_twin.simulation.gel_state import GelState
from gelslim_twin.simulation.twin_sensor import TwinSensor
from gelslim_twin.validation.case import FRICTION, Case, standard_cases
from gelslim_twin.validation.chain import CHAINS, Chain
from gelslim_twin.validation.truth_pad import truth_pad

Array = NDArray[np.float64]
Image = NDArray[np.uint8]
Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Outcome:
    """One chain on the last frame of one case; forces in N, motion in mm."""

    case: str
    chain: str
    true_n: tuple[float, float, float]
    found_n: tuple[float, float, float]
    """NaN where the chain does not know."""
    sigma_n: tuple[float, float, float]
    field_error: float
    """Of the nodal forces it knows, against the true ones, relative L2."""
    lateral_error_mm: float
    """Root mean square over the markers."""
    misfit: float
    """Share of the motion that forces on the contact found do not explain."""
    coverage: float
    milliseconds: float
    problems: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Validation:
    """All outcomes, and the last frame of each case for pictures."""

    outcomes: tuple[Outcome, ...]
    frames: Mapping[str, Image]
    results: Mapping[str, FrameResult]
    """Of the first chain, by case."""
    calibration: SensorCalibration

    def to_record(self) -> dict[str, Any]:
        """Plain values."""
        return {"outcomes": [asdict(o) for o in self.outcomes]}


def validate(
    sensor: TwinSensor, folder: Path | None = None, seed: int = 0, progress: Progress | None = None
) -> Validation:
    """Validate a sensor; `folder` keeps the compliance of the pad.

    Raises ContactError where a contact is not found, CalibrationError where the sensor's own
    reference frame is refused.
    """
    tell = progress or (lambda text, done, total: None)
    bundle = sensor.bundle
    length, width = sensor.size_mm
    thickness = bundle.mesh.layers * bundle.mesh.cell_size_mm[2]
    cases = standard_cases(thickness, length, width)
    compliance = SurfaceCompliance(truth_pad(bundle), folder)
    renderer = _renderer(sensor, seed)
    reference = renderer.frame(number=0).image
    calibration = calibrate(bundle, reference)
    outcomes: list[Outcome] = []
    frames: dict[str, Image] = {}
    results: dict[str, FrameResult] = {}
    for number, case in enumerate(cases):
        tell(case.name, number, len(cases))
        states = _states(compliance, case)
        images = [
            renderer.frame(
                SurfaceState.from_nodes(sensor.points_mm, s.displacement_mm),
                number=100 * (number + 1) + k,
            ).image
            for k, s in enumerate(states)
        ]
        frames[case.name] = images[-1]
        for chain, result in _estimates(sensor, calibration, reference, case, states, images):
            outcomes.append(_outcome(sensor, calibration, case, chain, states[-1], result))
            results.setdefault(case.name, result)
    tell("done", len(cases), len(cases))
    compliance.store()
    return Validation(tuple(outcomes), frames, results, calibration)


def _states(compliance: SurfaceCompliance, case: Case) -> list[GelState]:
    tool = Tool.of((case.indenter,), Path())
    solver = ContactSolver(compliance, tool, ContactSettings(friction=FRICTION))
    return list(solver.states(case.poses))


def _renderer(sensor: TwinSensor, seed: int) -> FrameRenderer:
    from gelslim_force.bundle_camera import bundle_camera

    record = sensor.camera_record
    aperture = float(record.get("aperture_mm") or 0.0)
    focus = float(record.get("focus_mm") or 1e6)
    pad = Pad(*sensor.size_mm, sensor.corner_radius_mm, mottle=0.04, vignetting=0.7, seed=seed)
    look = sensor_look(aperture, focus, seed)
    return FrameRenderer(bundle_camera(sensor.bundle), sensor.grid, sensor.light(), pad, look)


def _estimates(
    sensor: TwinSensor,
    calibration: SensorCalibration,
    reference: Image,
    case: Case,
    states: list[GelState],
    images: list[Image],
) -> Iterator[tuple[Chain, FrameResult]]:
    for chain in CHAINS:
        pipeline = ForcePipeline(sensor.bundle, calibration, chain.settings)
        if chain.knows in ("shape", "cap"):
            if not case.known:
                continue
            pipeline.normal = _source(pipeline, reference, case.known, chain.knows == "cap")
        result = None
        for state, image in zip(states, images, strict=True):
            given = state.displacement_mm[:, 2] if chain.knows == "depth" else None
            result = pipeline.process(image, normal_mm=given)
        if result is not None:
            yield chain, result


def _source(pipeline: ForcePipeline, reference: Image, known: str, cap_only: bool) -> Any:
    from dataclasses import replace

    from gelslim_force.indenter import parse_indenter
    from gelslim_force.indenter_source import indenter_source

    source = indenter_source(pipeline, reference, parse_indenter(known))
    return replace(source, cap_only=True) if cap_only else source


def _outcome(
    sensor: TwinSensor,
    calibration: SensorCalibration,
    case: Case,
    chain: Chain,
    truth: GelState,
    result: FrameResult,
) -> Outcome:
    unknown = np.full(3, np.nan)
    found, sigma, field, lateral, misfit = unknown, unknown, np.nan, np.nan, np.nan
    if result.wrench is not None and result.field is not None:
        found, sigma = result.wrench.force_n, result.wrench.standard_deviation[:3]
        known = np.isfinite(result.field.force_n)
        off = np.where(known, result.field.force_n - truth.force_n, 0.0)
        size = np.linalg.norm(np.where(known, truth.force_n, 0.0))
        field = float(np.linalg.norm(off) / size) if size > 0 else np.nan
        misfit = result.field.misfit
    if result.marker_displacement_mm is not None:
        lateral = _lateral_error(sensor, calibration, truth, result.marker_displacement_mm)
    return Outcome(
        case=case.name,
        chain=chain.name,
        true_n=_three(truth.force_n.sum(axis=0)),
        found_n=_three(found),
        sigma_n=_three(sigma),
        field_error=field,
        lateral_error_mm=lateral,
        misfit=misfit,
        coverage=result.coverage,
        milliseconds=sum(result.stage_ms.values()),
        problems=result.problems,
    )


def _three(values: Array) -> tuple[float, float, float]:
    x, y, z = (float(v) for v in values)
    return x, y, z


def _lateral_error(
    sensor: TwinSensor, calibration: SensorCalibration, truth: GelState, found_mm: Array
) -> float:
    from ifem_export.interpolation import marker_to_node

    followed = calibration.reference.markers
    places = sensor.grid.positions_mm[followed]
    true = marker_to_node(sensor.points_mm, places) @ truth.displacement_mm
    off = (found_mm - true)[:, :2]
    return float(np.sqrt(np.nanmean((off**2).sum(axis=1))))
