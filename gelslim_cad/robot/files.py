"""All files of the folder `robot`, by path."""

from __future__ import annotations

from gelslim_cad.export.mesh import TriangleMesh
from gelslim_cad.export.print_files import stl_bytes
from gelslim_cad.geometry.lookup import Lookup
from gelslim_cad.robot.mjcf import finger_bytes, gripper_bytes
from gelslim_cad.robot.model import RobotFinger
from gelslim_cad.robot.pieces import Piece
from gelslim_cad.robot.scene import gripper_scene
from gelslim_cad.robot.urdf import MESHES, urdf_bytes
from gelslim_cad.robot.usda import usda_bytes

FOLDER = "robot"


def robot_files(finger: RobotFinger, d: Lookup) -> dict[str, tuple[bytes, str]]:
    """Content and purpose of every file but `model.json`, by path in the folder of a build.

    Args:
        finger: The finger.
        d: Dimensions and spec fields, for the example scene.

    Returns:
        The files; their bytes are the same for the same finger.
    """
    files = {
        "finger.urdf": (urdf_bytes(finger), "the finger for ROS and others, URDF"),
        "finger.xml": (finger_bytes(finger), "the finger for MuJoCo, MJCF"),
        "gripper.xml": (
            gripper_bytes(finger, gripper_scene(d)),
            "example for MuJoCo: two fingers grip an object",
        ),
        "finger.usda": (usda_bytes(finger), "the finger for Isaac Sim and others, USD"),
    }
    files |= {
        f"{MESHES}/{piece.name}.stl": (_metres(piece), "mesh of the robot models, metres")
        for piece in finger.pieces
    }
    return {f"{FOLDER}/{path}": content for path, content in files.items()}


def _metres(piece: Piece) -> bytes:
    mesh = piece.mesh
    return stl_bytes(TriangleMesh(mesh.vertices_mm * 1e-3, mesh.faces), b"metres")
