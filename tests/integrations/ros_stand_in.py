"""Stand-ins for ROS 2: messages by the published definitions, and a node without a middleware."""

from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any, ClassVar

import numpy as np
import pytest

INTEGRATION = Path(__file__).parents[2] / "integrations" / "ros2"
OWN = INTEGRATION / "gelslim_msgs" / "msg"
if str(INTEGRATION / "gelslim_ros") not in sys.path:
    sys.path.append(str(INTEGRATION / "gelslim_ros"))


def type_store() -> Any:
    """The message definitions of ROS 2 Humble with our own; skips the test without rosbags."""
    pytest.importorskip("rosbags", reason="rosbags, which brings ROS 2 definitions, is missing")
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    for path in sorted(OWN.glob("*.msg")):
        kind = f"gelslim_msgs/msg/{path.stem}"
        store.register(get_types_from_msg(path.read_text(encoding="utf-8"), kind))
    return store


def empty(store: Any, kind: str) -> Any:
    """A message with its default values, as the constructors of rclpy make it."""
    _, fields = store.fielddefs[kind]
    return store.types[kind](**{name: _default(store, field) for name, field in fields})


def _default(store: Any, field: Any) -> Any:
    node, detail = field
    if node.name == "NAME":
        return empty(store, detail)
    if node.name == "BASE":
        return "" if detail[0] == "string" else 0
    (inner, kind), size = detail
    if inner.name == "BASE" and kind[0] != "string":
        return np.zeros(size, dtype={"octet": "uint8", "byte": "uint8"}.get(kind[0], kind[0]))
    return []


def with_arrays(store: Any, message: Any) -> Any:
    """The message with numbers in arrays, as rosbags writes them; rclpy takes any sequence."""
    for name, (node, detail) in store.fielddefs[message.__msgtype__][1]:
        value = getattr(message, name)
        if node.name == "NAME":
            with_arrays(store, value)
        elif node.name in ("ARRAY", "SEQUENCE"):
            (inner, kind), size = detail
            if inner.name == "NAME":
                for part in value:
                    with_arrays(store, part)
            elif kind[0] != "string":
                made = np.asarray(value, dtype=kind[0])
                assert not size or len(made) == size, name
                setattr(message, name, made)
    return message


class StandInNode:
    """What `ForceNode` uses of `rclpy.node.Node`."""

    given: ClassVar[dict[str, Any]] = {}

    def __init__(self, name: str) -> None:
        self._name, self._values = name, {}
        self.published: dict[str, list[Any]] = {}
        self.services: dict[str, Any] = {}
        self.subscriptions: dict[str, Any] = {}
        self.errors: list[str] = []

    def declare_parameter(self, name: str, default: Any) -> None:
        value = self.given.get(name, default)
        # As in ROS, the default fixes the type.
        assert isinstance(value, type(default)), name
        self._values[name] = value

    def get_parameter(self, name: str) -> Any:
        return SimpleNamespace(value=self._values[name])

    def get_name(self) -> str:
        return self._name

    def create_publisher(self, kind: Any, topic: str, depth: int) -> Any:
        sent = self.published.setdefault(topic, [])
        return SimpleNamespace(publish=sent.append)

    def create_service(self, kind: Any, name: str, call: Any) -> None:
        self.services[name] = call

    def create_subscription(self, kind: Any, topic: str, call: Any, qos: Any) -> None:
        self.subscriptions[topic] = call

    def get_clock(self) -> Any:
        stamp = SimpleNamespace(sec=12, nanosec=34)
        return SimpleNamespace(now=lambda: SimpleNamespace(to_msg=lambda: stamp))

    def get_logger(self) -> Any:
        def keep(text: str, **_: Any) -> None:
            self.errors.append(text)

        return SimpleNamespace(error=keep, warning=keep)


def install(monkeypatch: pytest.MonkeyPatch, store: Any) -> None:
    """Put modules of ROS with these stand-ins where `force_node` imports them."""

    def module(name: str, **members: Any) -> None:
        made = ModuleType(name)
        made.__dict__.update(members)
        monkeypatch.setitem(sys.modules, name, made)

    def messages(package: str, *names: str) -> None:
        def constructor(name: str) -> Any:
            def made() -> Any:
                return empty(store, f"{package}/msg/{name}")

            made.__name__ = name
            return made

        module(package)
        module(f"{package}.msg", **{name: constructor(name) for name in names})

    messages("diagnostic_msgs", "DiagnosticArray", "DiagnosticStatus", "KeyValue")
    messages("gelslim_msgs", "ForceField", "WrenchWithCovarianceStamped")
    messages("geometry_msgs", "WrenchStamped")
    messages("sensor_msgs", "Image")
    module("std_srvs")
    module("std_srvs.srv", Trigger=object)
    module("rclpy")
    module("rclpy.node", Node=StandInNode)
    module("rclpy.qos", qos_profile_sensor_data=object())
