"""The node of one finger, and the frames of its gel and camera from its robot model."""

from pathlib import Path

from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from launch import LaunchDescription

ARGUMENTS = {
    "finger": "folder that `gelslim build` wrote",
    "calibration": "file of `gelslim calibrate`",
    "image_topic": "topic of the camera's pictures",
    "camera": "number of a camera of this computer instead of a topic; -1 for none",
    "namespace": "namespace of the finger, for several of them",
}
DEFAULTS = {"image_topic": "image_raw", "camera": "-1", "namespace": "gelslim"}


def nodes(context) -> list[Node]:
    """The nodes for the values of the arguments."""
    value = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    folder = Path(value["finger"])
    robot = folder.resolve() / "robot"
    model = (robot / "finger.urdf").read_text(encoding="utf-8")
    # Viewers look for meshes beside the model only if they know where it lies.
    model = model.replace('filename="meshes/', f'filename="file://{robot}/meshes/')
    force = {
        "bundle": str(folder / "bundle"),
        "calibration": value["calibration"],
        "image_topic": value["image_topic"],
        "camera": int(value["camera"]),
    }
    return [
        Node(package="gelslim_ros", executable="force", name="force",
             namespace=value["namespace"], parameters=[force], output="screen"),
        Node(package="robot_state_publisher", executable="robot_state_publisher",
             namespace=value["namespace"], parameters=[{"robot_description": model}]),
    ]  # fmt: skip


def generate_launch_description() -> LaunchDescription:
    """What `ros2 launch gelslim_ros force.launch.py finger:=FOLDER calibration:=FILE` starts."""
    arguments = [
        DeclareLaunchArgument(name, description=text, **(
            {"default_value": DEFAULTS[name]} if name in DEFAULTS else {}))
        for name, text in ARGUMENTS.items()
    ]  # fmt: skip
    return LaunchDescription([*arguments, OpaqueFunction(function=nodes)])
