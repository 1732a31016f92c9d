"""Node `force`: the pictures of a camera or a topic become wrench, force field and diagnostics.

Parameters: `bundle`, `calibration` and, as for `gelslim force`, `indenter`, `gel_calibration`,
`light_calibration`; `image_topic`, or `camera` with the number of a camera of this computer;
`frame_id` and `overlay_every`. Service: `~/tare`.
"""

from __future__ import annotations

import threading
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from gelslim_msgs.msg import ForceField, WrenchWithCovarianceStamped
from geometry_msgs.msg import WrenchStamped
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import Image
from std_srvs.srv import Trigger

from gelslim_core.errors import GelslimError
from gelslim_force.frames.source import open_frames
from gelslim_force.sensor import open_sensor
from gelslim_ros.force_server import ForceServer
from gelslim_ros.messages import Fields, PictureMessageError, fill, picture_of

NO_CAMERA = -1
MESSAGES: dict[str, Any] = {
    "wrench": WrenchStamped,
    "wrench_covariance": WrenchWithCovarianceStamped,
    "force_field": ForceField,
    "overlay": Image,
}


class ForceNode(Node):
    """Publishes the forces of one sensor."""

    def __init__(self) -> None:
        super().__init__("force")
        for name in ("bundle", "calibration", "indenter", "gel_calibration", "light_calibration"):
            self.declare_parameter(name, "")
        self.declare_parameter("image_topic", "image_raw")
        self.declare_parameter("camera", NO_CAMERA)
        self.declare_parameter("frame_id", "gel")
        self.declare_parameter("overlay_every", 6)
        self._topics = {
            topic: self.create_publisher(kind, f"~/{topic}", 10) for topic, kind in MESSAGES.items()
        }
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        pipeline = open_sensor(
            self._value("bundle"),
            calibration=self._value("calibration") or None,
            indenter=self._value("indenter") or None,
            gel_calibration=self._value("gel_calibration") or None,
            light_calibration=self._value("light_calibration") or None,
        )
        pipeline.prepare()
        self._server = ForceServer(
            pipeline,
            self._publish,
            self._value("frame_id"),
            self.get_name(),
            self._value("overlay_every"),
        )
        # The camera's thread and the executor's share one pipeline.
        self._one_at_a_time = threading.Lock()
        self.create_service(Trigger, "~/tare", self._tare)
        if self._value("camera") != NO_CAMERA:
            threading.Thread(target=self._follow_camera, daemon=True).start()
        else:
            topic = self._value("image_topic")
            self.create_subscription(Image, topic, self._take, qos_profile_sensor_data)

    def _value(self, name: str) -> Any:
        return self.get_parameter(name).value

    def _take(self, message: Any) -> None:
        stamp = message.header.stamp
        try:
            picture = picture_of(message)
        except PictureMessageError as error:
            self.get_logger().error(str(error), throttle_duration_sec=5.0)
            return
        with self._one_at_a_time:
            self._server.take(picture, stamp.sec + 1e-9 * stamp.nanosec)

    def _follow_camera(self) -> None:
        with open_frames(f"camera:{self._value('camera')}", latest=True) as frames:
            for frame in frames:
                if frame.image is None:
                    self.get_logger().warning(frame.problem, throttle_duration_sec=5.0)
                    continue
                with self._one_at_a_time:
                    self._server.take(frame.image, frame.stamp_s)

    def _publish(self, topic: str, fields: Fields) -> None:
        if topic != "diagnostics":
            self._topics[topic].publish(fill(MESSAGES[topic](), fields))
            return
        values = [fill(KeyValue(), {"key": k, "value": v}) for k, v in fields["values"]]
        status = fill(DiagnosticStatus(), {**fields, "values": values})
        array = fill(DiagnosticArray(), {"status": [status]})
        array.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(array)

    def _tare(self, _request: Any, response: Any) -> Any:
        with self._one_at_a_time:
            response.success, response.message = self._server.tare()
        return response


def main(arguments: list[str] | None = None) -> int:
    """Run the node until it is interrupted; 2 for a sensor that cannot be opened."""
    rclpy.init(args=arguments)
    try:
        node = ForceNode()
    except GelslimError as error:
        rclpy.logging.get_logger("gelslim_ros").fatal(str(error))
        rclpy.shutdown()
        return 2
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
    return 0
