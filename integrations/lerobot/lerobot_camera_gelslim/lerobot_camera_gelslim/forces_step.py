"""Forces as a part of the robot's state: a step of LeRobot's pipeline of observations.

Cameras of LeRobot return pictures alone. What else an observation holds is added by steps that run
between robot and data set or policy; each also tells which features it adds, so a recording has
them without further work.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from lerobot.configs.types import PipelineFeatureType
from lerobot.processor import ObservationProcessorStep, ProcessorStepRegistry

from gelslim_force.outputs.tactile_features import SCALARS, scalars
from lerobot_camera_gelslim.camera import GelslimCamera


@dataclass
@ProcessorStepRegistry.register("gelslim_forces")
class GelslimForcesStep(ObservationProcessorStep):
    """Adds the forces of fingers to observations, as numbers that become parts of the state.

    Attributes:
        cameras: The cameras of the robot by name; those that are no fingers are left alone.
        features: Which features of `SCALARS` are added.

    Raises:
        ValueError: A feature is unknown.
    """

    cameras: Mapping[str, Any] = field(default_factory=dict)
    features: tuple[str, ...] = tuple(SCALARS)

    def __post_init__(self) -> None:
        """Check the features."""
        unknown = [name for name in self.features if name not in SCALARS]
        if unknown:
            raise ValueError(
                f"features = {', '.join(unknown)}: choose of {', '.join(SCALARS)}; fields and "
                "markers are in `observation()` of the camera"
            )

    def observation(self, observation: dict[str, Any]) -> dict[str, Any]:
        """The observation with the forces of the pictures in it, such as `finger.fz_n`."""
        added: dict[str, float] = {}
        for name, camera in self._fingers.items():
            if name in observation:
                found = scalars(camera.observation(), self.features)
                added |= {f"{name}.{part}": value for part, value in found.items()}
        return {**observation, **added}

    def transform_features(self, features: dict[Any, dict[str, Any]]) -> dict[Any, dict[str, Any]]:
        """The features of observations with those that this step adds."""
        kind = PipelineFeatureType.OBSERVATION
        added = {
            f"{name}.{part}": float
            for name in self._fingers
            for feature in self.features
            for part in SCALARS[feature]
        }
        return {**features, kind: {**features.get(kind, {}), **added}}

    def get_config(self) -> dict[str, Any]:
        """What is saved of the step; cameras belong to the robot."""
        return {"features": list(self.features)}

    @property
    def _fingers(self) -> dict[str, GelslimCamera]:
        return {n: c for n, c in self.cameras.items() if isinstance(c, GelslimCamera)}
