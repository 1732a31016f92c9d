"""The pictures of a simulated press to the node, and its wrench beside the true force.

    python3 integrations/ros2/drawn_press.py out/press_sphere

The folder is one that `gelslim simulate` wrote. The node runs elsewhere, as
`ros2 run gelslim_ros force --ros-args -r __ns:=/gelslim -p bundle:=... -p calibration:=...`.
The exit status is 1 if no wrench comes or its normal force is further off than a fifth.
"""

from __future__ import annotations

import csv
import sys
import time
from pathlib import Path
from typing import Any

import rclpy
from geometry_msgs.msg import WrenchStamped
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import Image

from gelslim_force.frames.picture import read_picture
from gelslim_ros.messages import fill, image_fields

PICTURES, WRENCHES = "/gelslim/image_raw", "/gelslim/force/wrench"
START_S, FRAME_S = 180.0, 60.0
"""How long to wait for the node, and for the wrench of a picture: kernels are compiled at first."""
ALLOWED = 0.2


class Press(Node):
    """Publishes pictures one by one and keeps the wrenches by the seconds of their stamps."""

    def __init__(self) -> None:
        super().__init__("drawn_press")
        self.wrenches: dict[int, Any] = {}
        self._pictures = self.create_publisher(Image, PICTURES, qos_profile_sensor_data)
        self.create_subscription(WrenchStamped, WRENCHES, self._keep, 10)

    def _keep(self, message: Any) -> None:
        self.wrenches[message.header.stamp.sec] = message.wrench

    def wait_for_node(self) -> bool:
        """Whether somebody takes the pictures."""
        return self._wait(lambda: self._pictures.get_subscription_count() > 0, START_S)

    def normal_force_n(self, picture: Any, second: int) -> float | None:
        """The normal force that the node finds; None if no wrench comes."""
        header = {"stamp": {"sec": second, "nanosec": 0}, "frame_id": "camera"}
        self._pictures.publish(fill(Image(), image_fields(picture, header)))
        if not self._wait(lambda: second in self.wrenches, FRAME_S):
            return None
        return float(self.wrenches[second].force.z)

    def _wait(self, done: Any, most_s: float) -> bool:
        end = time.monotonic() + most_s
        while not done() and time.monotonic() < end:
            rclpy.spin_once(self, timeout_sec=0.1)
        return bool(done())


def main(folder: Path) -> int:
    """Send all pictures, compare the last wrench; the exit status."""
    with open(folder / "truth.csv", newline="", encoding="utf-8") as stream:
        truth = [float(row["fz_n"]) for row in csv.DictReader(stream)]
    pictures = sorted((folder / "frames").glob("frame_*.png"))
    rclpy.init()
    node, found = Press(), None
    try:
        if not node.wait_for_node():
            print(f"no node takes the pictures of {PICTURES}")
            return 1
        for second, path in enumerate(pictures, 1):
            found = node.normal_force_n(read_picture(path), second)
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
    print(f"normal force {found} N, true {truth[-1]} N")
    return int(found is None or not abs(found - truth[-1]) <= ALLOWED * abs(truth[-1]))


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
