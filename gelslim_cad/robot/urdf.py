"""The finger as URDF: a link with mass, meshes and fixed frames (REP 103: metres, radians)."""

from __future__ import annotations

from xml.etree import ElementTree as Xml

import numpy as np

from gelslim_cad.robot.frames import Transform, roll_pitch_yaw
from gelslim_cad.robot.model import RobotFinger, rounded
from gelslim_cad.robot.pieces import Piece

MESHES = "meshes"
"""Folder of the meshes, beside the file."""


def urdf_bytes(finger: RobotFinger) -> bytes:
    """The finger as URDF, the same bytes for the same finger.

    The links are `mount`, which is the root and has no mass, `finger`, `gel` and
    `camera_optical`. The friction, stiffness and damping of the gel are those that Gazebo reads.
    """
    robot = Xml.Element("robot", name=finger.name)
    for number, piece in enumerate(finger.visuals):
        material = Xml.SubElement(robot, "material", name=f"colour_{number}")
        Xml.SubElement(material, "color", rgba=rounded(piece.colour, 4))
    Xml.SubElement(robot, "link", name="mount")
    link = Xml.SubElement(robot, "link", name="finger")
    inertial = Xml.SubElement(link, "inertial")
    Xml.SubElement(inertial, "origin", xyz=rounded(finger.mass.centre_m), rpy="0 0 0")
    Xml.SubElement(inertial, "mass", value=rounded(finger.mass.mass_kg))
    tensor = finger.mass.inertia_kg_m2
    axes = "xyz"
    Xml.SubElement(
        inertial,
        "inertia",
        {f"i{axes[i]}{axes[k]}": rounded(tensor[i, k]) for i in range(3) for k in range(i, 3)},
    )
    for number, piece in enumerate(finger.visuals):
        visual = _with_mesh(link, "visual", piece)
        Xml.SubElement(visual, "material", name=f"colour_{number}")
    for piece in finger.collisions:
        _with_mesh(link, "collision", piece)
    _fixed(robot, "mount", "finger", np.eye(4))
    Xml.SubElement(robot, "link", name="gel")
    _fixed(robot, "finger", "gel", finger.frames.gel)
    Xml.SubElement(robot, "link", name="camera_optical")
    _fixed(robot, "finger", "camera_optical", finger.frames.optical)
    # MuJoCo looks for meshes beside a URDF, drops what is only seen, and joins fixed links.
    wishes = {
        "meshdir": MESHES,
        "discardvisual": "false",
        "fusestatic": "false",
        "strippath": "true",
    }
    Xml.SubElement(Xml.SubElement(robot, "mujoco"), "compiler", wishes)
    gazebo = Xml.SubElement(robot, "gazebo", reference="finger")
    for name, value in (
        ("mu1", finger.contact.friction),
        ("mu2", finger.contact.friction),
        ("kp", finger.contact.stiffness_n_m),
        ("kd", finger.contact.damping_n_s_m),
    ):
        Xml.SubElement(gazebo, name).text = rounded(value)
    return xml_bytes(robot)


def xml_bytes(root: Xml.Element) -> bytes:
    """An XML document, indented, in UTF-8."""
    Xml.indent(root)
    text = Xml.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="utf-8"?>\n{text}\n'.encode()


def _with_mesh(link: Xml.Element, kind: str, piece: Piece) -> Xml.Element:
    element = Xml.SubElement(link, kind, name=piece.name)
    Xml.SubElement(element, "origin", xyz="0 0 0", rpy="0 0 0")
    geometry = Xml.SubElement(element, "geometry")
    Xml.SubElement(geometry, "mesh", filename=f"{MESHES}/{piece.name}.stl")
    return element


def _fixed(robot: Xml.Element, parent: str, child: str, at: Transform) -> None:
    joint = Xml.SubElement(robot, "joint", name=f"{parent}_to_{child}", type="fixed")
    Xml.SubElement(joint, "parent", link=parent)
    Xml.SubElement(joint, "child", link=child)
    Xml.SubElement(joint, "origin", xyz=rounded(at[:3, 3]), rpy=rounded(roll_pitch_yaw(at[:3, :3])))
