"""Validation of a sensor on rendered frames with known forces.

The contacts are the paper's experiment and some others. Frames show everything that a real sensor
shows. The pipeline is given the sensor's bundle and a reference frame, nothing else. Several
variants of the pipeline, called chains, are compared. The paper's chains use one layer of fully
integrated cells, the projection compensation as printed, forces as stiffness times displacement,
and for a known shape the cap of the indenter below the rim of the contact patch.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from gelslim_core.budget.budget import Budget
from gelslim_force.calibration.calibration import calibrate
from gelslim_force.calibration.design import bundle_camera
from gelslim_force.calibration.sensor_calibration import Calibration
from gelslim_force.contact.indenter_source import IndenterSource
from gelslim_force.contact.normal_source import NormalReading
from gelslim_force.forces.estimator import ForceSettings
from gelslim_force.forces.frame_result import FrameResult
from gelslim_force.pipeline import ForcePipeline
from gelslim_force.settings import PipelineSettings
from gelslim_optics.camera.record import is_mono
from gelslim_twin.contact.gel_state import GelState
from gelslim_twin.contact.nonlinear import unfit
from gelslim_twin.render.look import lens_of, sensor_look
from gelslim_twin.render.surface_state import SurfaceState
from gelslim_twin.simulation.picture import sensor_renderer
from gelslim_twin.simulation.sensor import TwinSensor
from gelslim_twin.validation.error_budget import error_budget
from gelslim_twin.validation.experiment import (
    FRICTION,
    Case,
    TruthGel,
    other_contacts,
    sphere_experiment,
)
from gelslim_twin.validation.score import Sample, Score, Validation, score, summary
from ifem_export.bundle.bundle import Bundle
from ifem_export.markers.interpolation import marker_to_node
from ifem_export.operators.single_thread import single_threaded

Array = NDArray[np.float64]
Image = NDArray[np.uint8]
Progress = Callable[[str, int, int], None]
FRAMES_APART = 100
"""Distance of the frame numbers of two contacts, so that each has its own noise."""


Knows = Literal["contact", "depth", "shape", "cap", "light", "nothing"]
"""What the chain is given: the true heights (`depth`), with the true contact region (`contact`), or
the shape of the indenter (`shape`; `cap` with the paper's model of it), or the light in the bundle,
by which it finds the normal motion under an object of unknown shape (`light`)."""
FOUND_BY_COLOUR = ("shape", "cap")
"""Knowledge that needs a contact patch, which pictures of a mono camera do not show."""


@dataclass(frozen=True)
class Chain:
    """One variant of the pipeline."""

    name: str
    settings: PipelineSettings
    knows: Knows
    needs_even_layers: bool = False
    """It does not take crowned pads and cut cells."""


_LINEAR, _STRAINED = PipelineSettings(gel="linear"), PipelineSettings(gel="neo_hookean")
_PAPER = replace(
    _LINEAR, rung="paper", compensation="printed", force=ForceSettings(method="direct")
)
CHAINS: tuple[Chain, ...] = (
    Chain("ours, contact known", _LINEAR, "contact"),
    Chain("ours, depth known", _LINEAR, "depth"),
    Chain("ours, depth, neo-Hookean", _STRAINED, "depth", True),
    Chain("ours, shape known", _LINEAR, "shape"),
    Chain("ours, shape, neo-Hookean", _STRAINED, "shape", True),
    Chain("ours, nothing known", _LINEAR, "light"),
    Chain("ours, nothing, neo-Hookean", _STRAINED, "light", True),
    Chain("ours, tangential", _LINEAR, "nothing"),
    Chain("paper, depth known", _PAPER, "depth", True),
    Chain("paper, shape known", _PAPER, "cap", True),
)


def chains_for(bundle: Bundle, budget: Budget | None = None) -> tuple[Chain, ...]:
    """The chains for a bundle's pad and camera; those that name no operator get the budget."""
    fit, mono = unfit(bundle) is None, is_mono(bundle.camera)
    blind = (*FOUND_BY_COLOUR, "light") if mono else () if bundle.light else ("light",)
    return tuple(
        chain
        if chain.settings.rung is not None
        else replace(chain, settings=replace(chain.settings, budget=budget))
        for chain in CHAINS
        if (fit or not chain.needs_even_layers) and chain.knows not in blind
    )


class KnownContact:
    """The true normal motion and contact region as a normal source, one state per frame."""

    def __init__(self, states: Iterable[GelState]) -> None:
        self._left: Iterator[GelState] = iter(states)

    def look(self, image: NDArray[np.uint8], markers_px: Array) -> GelState:
        """The frame's state. Raises StopIteration beyond the last."""
        return next(self._left)

    def motion(
        self, seen: GelState, lateral_mm: NDArray[np.float64] | None = None
    ) -> NormalReading:
        """True heights, without doubt, and the nodes truly touched."""
        w = seen.displacement_mm[:, 2]
        return NormalReading(w, np.zeros(len(w)), seen.touch > 0)


class Bench:
    """A sensor with its renderer, its reference frame and the chains to compare."""

    def __init__(self, sensor: TwinSensor, seed: int, budget: Budget | None = None) -> None:
        self.sensor = sensor
        look = sensor_look(**lens_of(sensor.camera_record), seed=seed)
        self.renderer = sensor_renderer(sensor, bundle_camera(sensor.bundle), look, seed)
        self.reference: Image = self.renderer.frame(number=0).image
        self.calibration: Calibration = calibrate(sensor.bundle, self.reference)
        self.chains = chains_for(sensor.bundle, budget)
        self._pipelines = {c.name: self._pipeline(c) for c in self.chains}
        places = sensor.grid.positions_mm[self.calibration.reference.markers]
        self._to_markers: Any = marker_to_node(sensor.points_mm, places)

    def images(self, states: Sequence[GelState], first: int) -> list[Image]:
        """Frames of states, numbered from `first`."""
        return [
            self.renderer.frame(
                SurfaceState.from_nodes(self.sensor.points_mm, s.displacement_mm), number=first + k
            ).image
            for k, s in enumerate(states)
        ]

    def results(
        self, states: Sequence[GelState], images: Sequence[Image], known: str
    ) -> Iterator[tuple[Chain, list[FrameResult]]]:
        """Results of every chain; without a shape, chains that need it are skipped."""
        for chain in self.chains:
            pipeline = self._pipelines[chain.name]
            pipeline.reset()
            if chain.knows in FOUND_BY_COLOUR:
                if not known:
                    continue
                pipeline = pipeline.with_normal(self._source(chain, known))
            if chain.knows == "contact":
                pipeline = pipeline.with_normal(KnownContact(states))
            depth = chain.knows == "depth"
            yield (
                chain,
                [
                    pipeline.process(i, normal_mm=s.displacement_mm[:, 2] if depth else None)
                    for s, i in zip(states, images, strict=True)
                ],
            )

    def marker_error_mm(self, truth: GelState, result: FrameResult) -> float:
        """Root mean square error of the markers' motion in the plane."""
        found = result.marker_displacement_mm
        if found is None:
            return float("nan")
        off = (found - self._to_markers @ truth.displacement_mm)[:, :2]
        return float(np.sqrt(np.nanmean((off**2).sum(axis=1))))

    def score(
        self, test: int, frame: int, chain: Chain, truth: GelState, result: FrameResult
    ) -> Score:
        """The score of one result."""
        error = self.marker_error_mm(truth, result)
        return score(test, frame, chain.name, self.sensor.points_mm, truth, result, error)

    def _pipeline(self, chain: Chain) -> ForcePipeline:
        """The chain's pipeline, without the shape of an indenter."""
        if chain.knows != "light":
            return ForcePipeline(self.sensor.bundle, self.calibration, chain.settings)
        from gelslim_force.sensor import UNKNOWN, open_sensor

        return open_sensor(
            self.sensor.bundle,
            reference=self.reference,
            calibration=self.calibration,
            indenter=UNKNOWN,
            settings=chain.settings,
        )

    def _source(self, chain: Chain, known: str) -> IndenterSource:
        from gelslim_force.sensor import indenter_source

        source = indenter_source(
            self.sensor.bundle,
            self.calibration,
            self.reference,
            known,
            settings=chain.settings,
        )
        return replace(source, cap_only=chain.knows == "cap")


@single_threaded
def validate(
    sensor: TwinSensor,
    folder: Path | None = None,
    seed: int = 0,
    progress: Progress | None = None,
    budget: Budget | None = None,
) -> Validation:
    """Measure how well the force pipeline would do on a sensor before it is built.

    Args:
        sensor: The sensor.
        folder: Folder where the compliance of the pad is stored for the next time.
        seed: Seed of everything random in the frames.
        progress: Called with the present step, its number and the number of steps.
        budget: Chooses the operator of our chains from the bundle's ladder.

    Returns:
        Errors of every chain, frame by frame and in summary, and the error budget.

    Raises:
        BudgetError: No operator keeps the budget.
        ContactError: A contact does not converge.
        CalibrationError: The rendered reference frame cannot be calibrated.
    """
    tell = progress or (lambda text, done, total: None)
    bundle = sensor.bundle
    thickness = bundle.mesh.layers * bundle.mesh.cell_size_mm[2]
    experiment = sphere_experiment(thickness, *sensor.size_mm)
    cases = other_contacts(thickness, *sensor.size_mm)
    steps = len(experiment.tests) + len(cases) + 1
    gel, bench = TruthGel(bundle, FRICTION, folder), Bench(sensor, seed, budget)
    scores: list[Score] = []
    strained: list[GelState] = []
    linear: list[GelState] = []
    samples: list[Sample] = []
    others: dict[str, tuple[Score, ...]] = {}
    slides = [
        Case(f"slide {k}", experiment.ball, test.poses, experiment.known)
        for k, test in enumerate(experiment.tests, 1)
    ]
    for number, case in enumerate((*slides, *cases)):
        tell(case.name, number, steps)
        states = gel.states(case.indenter, case.poses, gel.law)[1:]
        images = bench.images(states, FRAMES_APART * (number + 1))
        rows, last = list[Score](), dict[str, FrameResult]()
        for chain, results in bench.results(states, images, case.known):
            rows += [
                bench.score(number, k, chain, s, r)
                for k, (s, r) in enumerate(zip(states, results, strict=True))
            ]
            last[chain.name] = results[-1]
        if number < len(slides):
            scores += rows
            strained += states
            linear += gel.states(case.indenter, case.poses, "linear")[1:]
        else:
            others[case.name] = tuple(row for row in rows if row.frame == len(states) - 1)
        samples.append(Sample(case.name, images[-1], states[-1], last))
    tell("error budget", steps - 1, steps)
    spreads = error_budget(bundle, strained, linear) if gel.law == "neo_hookean" else ()
    gel.compliance.store()
    tell("done", steps, steps)
    chains = tuple(summary(c.name, [s for s in scores if s.chain == c.name]) for c in bench.chains)
    return Validation(
        _statement(gel, bundle.mesh.layers), experiment, tuple(scores), chains, spreads, others,
        tuple(samples), sensor.points_mm, bench.calibration,
    )  # fmt: skip


def _statement(gel: TruthGel, layers: int) -> str:
    """Which model made the frames, and how it differs from that of the pipeline."""
    if gel.law == "linear":
        return (
            f"Frames come from contacts solved forward, with Coulomb friction {FRICTION:g}, on a "
            "linear gel of the pipeline's own mesh: crowned and cut pads have no finer or strained "
            "one here. Inverse and forward model are the same gel, so the errors of the mesh and "
            "of large strain are missing from these figures."
        )
    return (
        "No inverse crime: frames come from contacts solved forward, with Coulomb friction "
        f"{FRICTION:g}, on a neo-Hookean gel of {gel.layers} layers with F-bar cells; the pipeline "
        f"inverts a linear gel of {layers} layers with B-bar cells (the paper's choices: one layer "
        "of full cells). It gets pictures with noise, dirt and print faults and a picture at rest, "
        "and nothing is tuned to the results."
    )
