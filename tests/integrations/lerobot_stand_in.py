"""Stand-ins for what the camera of LeRobot uses of LeRobot, with the same names and rules."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from types import ModuleType
from typing import Any, ClassVar

import pytest

PLUGIN = "lerobot_camera_gelslim"


@dataclass(kw_only=True)
class CameraConfig:
    """The registry of LeRobot's configurations, by type."""

    kinds: ClassVar[dict[str, type]] = {}
    fps: int | None = None
    width: int | None = None
    height: int | None = None

    @classmethod
    def register_subclass(cls, name: str) -> Callable[[type], type]:
        def register(kind: type) -> type:
            cls.kinds[name] = kind
            return kind

        return register


class Camera:
    def __init__(self, config: CameraConfig) -> None:
        self.fps, self.width, self.height = config.fps, config.width, config.height

    def __enter__(self) -> Camera:
        self.connect()
        return self

    def __exit__(self, *_: object) -> None:
        self.disconnect()


class DeviceAlreadyConnectedError(ConnectionError):
    pass


class DeviceNotConnectedError(ConnectionError):
    pass


class PipelineFeatureType(Enum):
    ACTION = "ACTION"
    OBSERVATION = "OBSERVATION"


class ObservationProcessorStep:
    pass


class ProcessorStepRegistry:
    steps: ClassVar[dict[str, type]] = {}

    @classmethod
    def register(cls, name: str) -> Callable[[type], type]:
        def register(step: type) -> type:
            cls.steps[name] = step
            return step

        return register


def install(monkeypatch: pytest.MonkeyPatch) -> None:
    """Put the stand-ins where the plugin imports LeRobot, and forget the plugin."""
    members: dict[str, dict[str, Any]] = {
        "lerobot": {},
        "lerobot.cameras": {"Camera": Camera, "CameraConfig": CameraConfig},
        "lerobot.configs": {},
        "lerobot.configs.types": {"PipelineFeatureType": PipelineFeatureType},
        "lerobot.processor": {
            "ObservationProcessorStep": ObservationProcessorStep,
            "ProcessorStepRegistry": ProcessorStepRegistry,
        },
        "lerobot.utils": {},
        "lerobot.utils.errors": {
            "DeviceAlreadyConnectedError": DeviceAlreadyConnectedError,
            "DeviceNotConnectedError": DeviceNotConnectedError,
        },
    }
    for name, contents in members.items():
        module = ModuleType(name)
        module.__dict__.update(contents)
        monkeypatch.setitem(sys.modules, name, module)
    forget_plugin(monkeypatch)


def forget_plugin(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [m for m in sys.modules if m.split(".")[0] == PLUGIN]:
        monkeypatch.delitem(sys.modules, name)
