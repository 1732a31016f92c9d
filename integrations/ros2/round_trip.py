"""The messages of the node through the serialisation of ROS and back, every field compared.

python3 integrations/ros2/round_trip.py    # in an environment with rclpy and the built packages
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from gelslim_msgs.msg import ForceField as ForceFieldMessage
from gelslim_msgs.msg import WrenchWithCovarianceStamped
from geometry_msgs.msg import WrenchStamped
from rclpy.serialization import deserialize_message, serialize_message

from gelslim_force import ForceField, FrameResult, Wrench
from gelslim_ros.messages import covariance_fields, field_fields, fill, wrench_fields


def sample() -> FrameResult:
    """A frame with random numbers, unknown values and a problem."""
    random = np.random.default_rng(3)
    nodes = 40
    root = random.normal(size=(6, 6))
    field = ForceField(
        points_mm=random.normal(size=(nodes, 3)),
        displacement_mm=random.normal(size=(nodes, 3)),
        force_n=random.normal(size=(nodes, 3)),
        traction_mpa=random.normal(size=(nodes, 3)),
        contact=random.uniform(size=nodes) < 0.5,
        centre_of_pressure_mm=np.full(2, np.nan),
        slip_margin=float("nan"),
        misfit=0.25,
    )
    wrench = Wrench(random.normal(size=3), random.normal(size=3), root @ root.T)
    return FrameResult(
        index=7, time_s=0.5, stamp_s=1_795_441_687.125, field=field, wrench=wrench,
        problems=("größe",),
    )  # fmt: skip


def compare(message: Any, fields: Mapping[str, Any], name: str) -> None:
    """Raise AssertionError unless a message has these fields; NaN is equal to NaN."""
    for part, wanted in fields.items():
        found = getattr(message, part)
        if isinstance(wanted, Mapping):
            compare(found, wanted, f"{name}.{part}")
        elif isinstance(wanted, str | bool) or (len(np.atleast_1d(wanted)) and _texts(wanted)):
            assert found == wanted, f"{name}.{part}: {found!r} is not {wanted!r}"
        else:
            np.testing.assert_array_equal(
                np.asarray(found), np.asarray(wanted), err_msg=f"{name}.{part}"
            )


def _texts(values: Any) -> bool:
    return isinstance(values, list) and isinstance(values[0], str)


def main() -> None:
    """Send each message through the middleware's format."""
    result = sample()
    for kind, fields in (
        (WrenchStamped, wrench_fields(result, "gel")),
        (WrenchWithCovarianceStamped, covariance_fields(result, "gel")),
        (ForceFieldMessage, field_fields(result, "gel")),
    ):
        assert fields is not None
        sent = serialize_message(fill(kind(), fields))
        compare(deserialize_message(sent, kind), fields, kind.__name__)
        print(kind.__name__, len(sent), "bytes come back")


if __name__ == "__main__":
    main()
