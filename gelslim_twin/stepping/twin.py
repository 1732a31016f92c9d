"""A sensor that is stepped through time: poses of bodies in, forces and pictures out."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gelslim_twin.contact.soft_layer import SoftLayer
from gelslim_twin.scene.built_look import BuiltLook, read_look
from gelslim_twin.scene.scene import Scene
from gelslim_twin.simulation.picture import Viewer
from gelslim_twin.simulation.sensor import TwinSensor
from gelslim_twin.stepping.batch_solver import BatchSolver
from gelslim_twin.stepping.body import Body
from gelslim_twin.stepping.mechanics import SolvedStep, StepMechanics
from gelslim_twin.stepping.pictures import pad_size_mm, stepped_scene, stepped_viewer
from gelslim_twin.stepping.placement import Placement, placed
from gelslim_twin.stepping.request import Request
from gelslim_twin.stepping.rigid_motion import rigid_motions
from gelslim_twin.stepping.state import TwinState
from gelslim_twin.stepping.step import Step
from gelslim_twin.stepping.step_batch import StepBatch
from gelslim_twin.stepping.step_error import StepError
from ifem_export.bundle.files import load_bundle
from ifem_export.compliance.columns import SurfaceCompliance
from ifem_export.operators.single_thread import single_threaded

if TYPE_CHECKING:
    from gelslim_twin.effects.circumstances import EffectParameters
    from ifem_export.elements.skin import Membrane

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class _Sensor:
    """What twins of one sensor share: nothing in it depends on the steps."""

    sensor: TwinSensor
    folder: Path
    request: Request
    scene: Scene
    mechanics: StepMechanics
    look: BuiltLook | None = None

    @cached_property
    def viewer(self) -> Viewer:
        """Camera and renderer."""
        viewer = stepped_viewer(self.sensor, self.folder, self.scene, self.request)
        return replace(viewer, look=self.look)

    def view(self) -> Viewer:
        """The viewer, made at the first call."""
        return self.viewer

    @cached_property
    def batches(self) -> BatchSolver:
        """Solves many contacts."""
        return BatchSolver(self.mechanics, self.view)


class Twin:
    """A tactile sensor and the bodies that touch it, advanced step by step.

    The contact is quasi-static: a state follows from the last one and from the poses, and time
    counts for relaxation and motion blur only. Without contact nothing is solved, and a picture is
    drawn when it is asked for. A step that fails leaves the twin as it was.

    Attributes:
        bodies: The bodies, in the order in which `step` takes their poses.
        points_mm: Surface nodes (c, 3) at rest in the sensor frame.
        state: All that the next step depends on; set it to go back to it exactly.
    """

    def __init__(
        self,
        bundle: str | os.PathLike[str],
        observe: Iterable[str] = ("force",),
        tolerance: Mapping[str, str | float] | None = None,
        *,
        friction: float = 0.0,
        effects: Mapping[str, Any] | None = None,
        keep: str | os.PathLike[str] | None = None,
        seed: int = 0,
        look: str | os.PathLike[str] | None = None,
    ) -> None:
        """Open a sensor.

        Args:
            bundle: Folder of the bundle.
            observe: What is wanted, of `displacement`, `force`, `markers` and `image`.
            tolerance: Errors allowed: of `force` relative to the resultant, as "2%" or 0.02; of
                the others in pixels of the camera, as 0.2. By default 2 % and 0.2 px.
            friction: Coefficient of Coulomb friction between the bodies and the gel.
            effects: The block `effects` of a scene file, such as {"nonlinearity": "off"}.
            keep: Folder that keeps the compliance of the pad for the next twin; none by default.
            seed: Seed of noise, dirt and print faults.
            look: File of `gelslim calibrate-look`: pictures look like those of that built sensor.

        Raises:
            StepError: There is no such folder, or a setting cannot be used.
            LookError: The look cannot be read, or is that of another sensor.
            IfemError: The bundle is damaged, its pad is too fine, or it has no markers or no
                camera where these are observed.
        """
        folder = Path(bundle)
        if not folder.is_dir():
            raise StepError(
                f"{folder}: no such folder; name a bundle, which `gelslim bundle` writes"
            )
        request = Request.read(observe, tolerance)
        sensor = TwinSensor(load_bundle(folder))
        scene = stepped_scene(request, friction, effects, seed, pad_size_mm(sensor))
        built = None if look is None else read_look(look)
        if built is not None:
            built.require_bundle(sensor.bundle)
            seen = scene.effects.completed(built.effect_values())
            scene = scene.model_copy(update={"effects": seen})
        skin = _membranes(sensor, scene.effects.parameters())
        compliance = SurfaceCompliance(sensor.bundle, _made(keep), skin)
        mechanics = StepMechanics(
            compliance, request, scene.contact.friction, scene.effects.parameters()
        )
        self._shared = _Sensor(sensor, folder, request, scene, mechanics, built)
        if request.seen:
            _ = self._shared.viewer
        self._bodies: tuple[Body, ...] = ()
        self._state = self._initial()

    @property
    def bodies(self) -> tuple[Body, ...]:
        """The bodies, in the order in which `step` takes their poses."""
        return self._bodies

    @property
    def points_mm(self) -> Array:
        """Surface nodes (c, 3) at rest in the sensor frame."""
        return self._shared.mechanics.points_mm

    def add(self, body: Body) -> Body:
        """Add a body.

        Args:
            body: The body.

        Returns:
            The same body.

        Raises:
            StepError: It is no body, the twin was stepped already, or a body with a soft layer is
                not the only one.
        """
        if not isinstance(body, Body):
            raise StepError(
                f"{type(body).__name__} is no body; make one by Body.from_mesh, Body.sphere, "
                "Body.box or Body.from_indenters"
            )
        if self._state.number:
            raise StepError("a body is added before the first step; call reset before")
        self._shared.mechanics.require_layers_fit((*self._bodies, body))
        self._bodies = (*self._bodies, body)
        self._state = self._initial()
        return body

    def prepare(self) -> None:
        """Compute the compliance of the whole pad, which otherwise happens where it is touched.

        After it no step has to wait for that. The folder `keep` keeps it.
        """
        compliance = self._shared.mechanics.compliance
        compliance.require(np.arange(compliance.nodes))
        compliance.store()

    def reset(self) -> None:
        """Return to the undeformed gel at time 0; the bodies stay."""
        self._state = self._initial()

    def clone(self) -> Twin:
        """A twin of the same sensor, bodies and state, which then goes its own way.

        The two share what does not depend on the steps. They must not be stepped by two threads
        at once.
        """
        other = object.__new__(Twin)
        other._shared, other._bodies, other._state = self._shared, self._bodies, self._state
        return other

    @property
    def state(self) -> TwinState:
        """All that the next step depends on; set it to go back to it exactly.

        Setting raises StepError for the state of another sensor or another number of bodies.
        """
        return self._state

    @state.setter
    def state(self, state: TwinState) -> None:
        if not isinstance(state, TwinState):
            raise StepError(f"{type(state).__name__} is no state of a twin")
        if state.key != self._state.key:
            raise StepError(
                "the state belongs to another pad, another gel or another number of bodies"
            )
        self._state = state

    @single_threaded
    def step(self, poses: ArrayLike, dt: float) -> Step:
        """Move the bodies and solve the gel.

        Args:
            poses: Rigid motions of the k bodies in the sensor frame: matrices (k, 4, 4) in mm, or
                x, y, z in mm with a unit quaternion w, x, y, z as (k, 7); for a single body also
                (4, 4) or (7,).
            dt: Time since the last step in s.

        Returns:
            The gel after the step.

        Raises:
            StepError: There is no body, a pose or the time cannot be used, or a body goes deeper
                than the gel allows.
            ContactError: The contact does not converge.
        """
        if not self._bodies:
            raise StepError("the twin has no body; add one before the first step")
        step_s = _duration(dt)
        motions = rigid_motions(poses, len(self._bodies))
        last = self._state
        placement = placed(
            self._bodies, motions, last.motions, (last.time_s, last.time_s + step_s), self._top_mm
        )
        solved = self._solved(motions, placement)
        gel = self._shared.mechanics.gel_alone(solved.gel, self._layer)
        memory = last.relaxation
        series = self._shared.mechanics.series
        if series is not None:
            from gelslim_twin.contact.relaxation import at_rest, relax

            memory = at_rest(series, len(gel.force_n)) if memory is None else memory
            force, memory = relax(series, memory, gel.force_n, step_s)
            gel = replace(gel, force_n=force)
        before = self._shared.mechanics.gel_alone(last.solved.gel, self._layer)
        self._state = TwinState(
            last.key, last.time_s + step_s, last.number + 1, motions, solved, memory
        )
        return Step(
            time_s=self._state.time_s,
            step_s=step_s,
            number=self._state.number,
            points_mm=self.points_mm,
            gel=gel,
            solved=solved,
            before=before,
            motions=motions,
            placement=placement,
            request=self._shared.request,
            mechanics=self._shared.mechanics,
            view=self._shared.view,
        )

    def batch(
        self,
        poses: ArrayLike,
        *,
        backend: Literal["numpy", "torch"] = "numpy",
        device: str = "cpu",
        precision: Literal["double", "single"] = "double",
    ) -> StepBatch:
        """Solve many contacts, each from the untouched gel. The state of the twin stays.

        Args:
            poses: Rigid motions of the k bodies in each of n contacts: (n, k, 4, 4) or (n, k, 7)
                as for `step`; for a single body also (n, 4, 4) or (n, 7).
            backend: "numpy" solves one contact after the other, as `step` does after `reset`.
                "torch" solves contacts without friction on a linear gel side by side.
            device: Device of PyTorch: "cpu" or "cuda".
            precision: Precision of PyTorch's forces, displacements and pictures.

        Returns:
            The contacts. A pose that cannot be solved is in its `errors`; the others are whole.

        Raises:
            StepError: There is no body, the shape of the poses is another, the gel relaxes, or the
                backend does not solve contacts of this twin.
            MissingLibraryError: PyTorch is not installed.
        """
        return self._shared.batches.solved(self._bodies, poses, backend, device, precision)

    def _solved(self, motions: Array, placement: Placement | None) -> SolvedStep:
        last, mechanics = self._state, self._shared.mechanics
        if placement is None:
            return mechanics.rest
        if last.motions is not None and np.array_equal(motions, last.motions):
            return last.solved
        return mechanics.advanced(placement, last.solved)

    @property
    def _layer(self) -> SoftLayer | None:
        return self._bodies[0].layer if self._bodies else None

    @property
    def _top_mm(self) -> float:
        return self._shared.mechanics.top_mm

    def _initial(self) -> TwinState:
        compliance = self._shared.mechanics.compliance
        key = f"{compliance.key}-{len(self._bodies)}"
        return TwinState(key, 0.0, 0, None, self._shared.mechanics.rest)


def _membranes(sensor: TwinSensor, effects: Mapping[str, EffectParameters]) -> tuple[Membrane, ...]:
    """Coat and fabric of the sensor, unless they are switched off."""
    skin = sensor.bundle.skin
    if skin is None or effects["skin"].use == "off":
        return ()
    if effects["nonlinearity"].use == "on":
        raise StepError(
            "the sensor's gel has a coat or a fabric, large strain takes a bare gel: switch one "
            "of the effects nonlinearity and skin off"
        )
    return skin.membranes


def _made(keep: str | os.PathLike[str] | None) -> Path | None:
    if keep is None:
        return None
    try:
        Path(keep).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise StepError(f"keep: {keep}: {reason}; choose a folder you can write to") from None
    return Path(keep)


def _duration(dt: float) -> float:
    try:
        found = float(dt)
    except (TypeError, ValueError):
        raise StepError(f"dt = {dt!r}: must be a number of seconds above 0") from None
    if not (np.isfinite(found) and found > 0):
        raise StepError(f"dt = {found}: must be a number of seconds above 0")
    return found
