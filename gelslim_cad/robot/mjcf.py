"""The finger as MJCF, and a parallel gripper of two fingers as a scene, for MuJoCo."""

from __future__ import annotations

from collections.abc import Mapping
from xml.etree import ElementTree as Xml

import numpy as np

from gelslim_cad.robot.frames import quaternion_wxyz
from gelslim_cad.robot.model import RobotFinger, rounded
from gelslim_cad.robot.scene import GripperScene
from gelslim_cad.robot.urdf import MESHES, xml_bytes

SIDES = {
    "left": np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]),
    "right": np.array([[0.0, 0.0, -1.0], [0.0, -1.0, 0.0], [-1.0, 0.0, 0.0]]),
}
"""How the two fingers of the scene stand: both hang down, and their gels look at each other."""
PAD_DEPTH_M = 0.5e-3
"""Half the thickness of the box around the gel's surface in which contacts are felt."""
Element = Xml.Element


def add(parent: Element, tag: str, more: Mapping[str, str] | None = None, **given: str) -> Element:
    """Append an element with these attributes; `more` has those that are words of Python."""
    return Xml.SubElement(parent, tag, {**(more or {}), **given})


def finger_bytes(finger: RobotFinger) -> bytes:
    """The finger as MJCF: a body at the mount's frame, fixed to the world."""
    root = _root(finger.name)
    _assets(root, finger)
    _body(add(root, "worldbody"), finger, "", {})
    return xml_bytes(root)


def gripper_bytes(finger: RobotFinger, scene: GripperScene) -> bytes:
    """Two fingers on slides that face each other, a lift, and an object on a post.

    Actuators: `left_grip` and `right_grip` are the closing forces of the jaws in N, `lift` is the
    height of the hand in m. Sensors: the normal force that each gel feels. The keyframe `closing`
    sets the gripping force of the spec.
    """
    root = _root(f"{finger.name} gripper")
    option = add(
        root,
        "option",
        timestep=rounded(finger.contact.timestep_s, 3),
        integrator="implicitfast",
        cone="elliptic",
        impratio="10",
    )
    # Several points where a flat object meets a mesh: MuJoCo before 3.8 gives one unless asked.
    add(option, "flag", multiccd="enable")
    look = add(root, "visual")
    add(look, "global", offwidth="1280", offheight="960")
    add(look, "headlight", ambient="0.4 0.4 0.4", diffuse="0.6 0.6 0.6")
    sky = {"type": "skybox", "builtin": "gradient", "rgb1": "0.75 0.82 0.9", "rgb2": "1 1 1"}
    add(_assets(root, finger), "texture", sky, width="64", height="64")
    world = add(root, "worldbody")
    add(world, "light", pos="0.1 -0.3 0.6", dir="-0.2 0.5 -1")
    add(
        world,
        "geom",
        name="post",
        type="box",
        size=rounded(scene.post_half_m),
        pos=rounded([0, 0, -scene.object_half_m[2] - scene.post_half_m[2]]),
        rgba="0.6 0.6 0.6 1",
    )
    hand = add(world, "body", name="hand", gravcomp="1")
    add(hand, "joint", name="lift", type="slide", axis="0 0 1", range="0 0.2")
    _small_mass(hand, scene.jaw_kg)
    _palm(hand, finger, scene)
    for side, rotation in SIDES.items():
        _jaw(hand, finger, scene, side, rotation)
    thing = add(world, "body", name="object")
    add(thing, "freejoint", name="object")
    add(
        thing,
        "geom",
        name="object",
        type="box",
        size=rounded(scene.object_half_m),
        mass=rounded(scene.object_kg),
        rgba="0.9 0.6 0.2 1",
    )
    _drives(root, scene)
    return xml_bytes(root)


def _root(name: str) -> Element:
    root = Xml.Element("mujoco", model=name)
    add(root, "compiler", angle="radian", meshdir=MESHES, autolimits="true")
    default = add(root, "default")
    seen = add(default, "default", {"class": "visual"})
    add(seen, "geom", type="mesh", contype="0", conaffinity="0", group="2")
    hit = add(default, "default", {"class": "collision"})
    add(hit, "geom", type="mesh", group="3", rgba="0.5 0.6 0.8 0.3")
    return root


def _assets(root: Element, finger: RobotFinger) -> Element:
    assets = add(root, "asset")
    for piece in finger.pieces:
        add(assets, "mesh", name=piece.name, file=f"{piece.name}.stl")
    return assets


def _body(parent: Element, finger: RobotFinger, prefix: str, place: dict[str, str]) -> Element:
    """The finger's body; mass and inertia are stated, so that no geom adds to them."""
    body = add(parent, "body", {"name": f"{prefix}finger", **place})
    tensor = finger.mass.inertia_kg_m2
    six = [tensor[i, k] for i, k in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
    add(
        body,
        "inertial",
        pos=rounded(finger.mass.centre_m),
        mass=rounded(finger.mass.mass_kg),
        fullinertia=rounded(six),
    )
    for piece in finger.visuals:
        add(
            body,
            "geom",
            {"class": "visual", "mesh": piece.name, "rgba": rounded(piece.colour, 4)},
        )
    for piece in finger.collisions:
        geom = add(body, "geom", {"class": "collision", "mesh": piece.name})
        geom.set("name", f"{prefix}{piece.name}")
        if piece.name == "collision_gel":
            _soften(geom, finger)
    add(body, "site", name=f"{prefix}mount", size="0.001")
    add(body, "site", _placed(finger.frames.gel), name=f"{prefix}gel", size="0.001")
    add(
        body,
        "camera",
        _placed(finger.frames.graphics),
        name=f"{prefix}camera",
        fovy=rounded(finger.fov_y_rad),
        resolution=f"{finger.image_px[0]} {finger.image_px[1]}",
    )
    return body


def _soften(geom: Element, finger: RobotFinger) -> None:
    contact = finger.contact
    geom.set("condim", "4")
    geom.set("priority", "1")
    geom.set("friction", f"{rounded(contact.friction)} {rounded(contact.torsion_m)} 0.0001")
    geom.set("solref", rounded(contact.solref))
    geom.set("solimp", rounded(contact.solimp))


def _jaw(
    hand: Element,
    finger: RobotFinger,
    scene: GripperScene,
    side: str,
    rotation: np.ndarray,
) -> None:
    """A jaw on its slide, with a finger whose gel stands the gap away from the object."""
    sign = 1.0 if side == "left" else -1.0
    jaw = add(hand, "body", name=f"{side}_jaw", gravcomp="1")
    add(
        jaw,
        "joint",
        name=f"{side}_jaw",
        type="slide",
        axis=rounded([sign, 0, 0]),
        range=rounded([0, scene.travel_m]),
        damping=rounded(scene.jaw_damping_n_s_m),
    )
    _small_mass(jaw, scene.jaw_kg)
    surface = np.array([-sign * (scene.object_half_m[0] + scene.gap_m), 0.0, 0.0])
    place = {
        "pos": rounded(surface - rotation @ finger.frames.gel[:3, 3]),
        "quat": rounded(quaternion_wxyz(rotation)),
        "gravcomp": "1",
    }
    body = _body(jaw, finger, f"{side}_", place)
    half = [*(np.array(scene.gel_mm) / 2000), PAD_DEPTH_M]
    add(
        body,
        "site",
        _placed(finger.frames.gel),
        name=f"{side}_pad",
        type="box",
        size=rounded(half),
        rgba="0 0 0 0",
    )


def _palm(hand: Element, finger: RobotFinger, scene: GripperScene) -> None:
    """A bar over the jaws, only to be seen."""
    highest_m = -min(piece.mesh.vertices_mm[:, 0].min() for piece in finger.visuals) * 1e-3
    mount_m = finger.frames.gel[0, 3]
    across = scene.object_half_m[0] + scene.gap_m + finger.frames.gel[2, 3]
    half = [across + 0.02, 0.02, 0.012]
    add(
        hand,
        "geom",
        {"class": "visual", "type": "box"},
        pos=rounded([0, 0, mount_m + highest_m + 0.004 + half[2]]),
        size=rounded(half),
        rgba="0.45 0.47 0.5 1",
    )


def _small_mass(body: Element, mass_kg: float) -> None:
    moment = mass_kg * 0.02**2
    add(
        body,
        "inertial",
        pos="0 0 0",
        mass=rounded(mass_kg),
        diaginertia=rounded([moment] * 3),
    )


def _drives(root: Element, scene: GripperScene) -> None:
    equality = add(root, "equality")
    add(equality, "joint", joint1="left_jaw", joint2="right_jaw", polycoef="0 1 0 0 0")
    actuators = add(root, "actuator")
    for side in SIDES:
        add(
            actuators,
            "motor",
            name=f"{side}_grip",
            joint=f"{side}_jaw",
            ctrlrange=rounded([-scene.most_force_n, scene.most_force_n]),
        )
    add(
        actuators,
        "position",
        name="lift",
        joint="lift",
        kp="5000",
        dampratio="1",
        ctrlrange="0 0.2",
    )
    sensors = add(root, "sensor")
    for side in SIDES:
        add(sensors, "touch", name=f"{side}_force", site=f"{side}_pad")
    keys = add(root, "keyframe")
    add(keys, "key", name="closing", ctrl=rounded([scene.force_n, scene.force_n, 0]))


def _placed(transform: np.ndarray) -> dict[str, str]:
    return {
        "pos": rounded(transform[:3, 3]),
        "quat": rounded(quaternion_wxyz(transform[:3, :3])),
    }
