"""The finger as USD in text form (usda), with the physics schemas that Isaac Sim reads."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.robot.frames import Transform, quaternion_wxyz
from gelslim_cad.robot.model import RobotFinger, rounded
from gelslim_cad.robot.pieces import Piece

MESH_DIGITS = 7
"""Significant digits of a vertex in metres: float32 keeps no more."""


def usda_bytes(finger: RobotFinger) -> bytes:
    """The finger as USD: metres, kilograms, z up, everything in the mount's frame.

    The body has mass, centre of mass, principal moments and axes. Meshes that are seen have
    preview surfaces; those that collide are convex hulls with the friction of the gel.
    """
    lines = [
        "#usda 1.0",
        "(",
        '    defaultPrim = "finger"',
        f'    doc = "{_quoted(finger.name)}, a tactile finger; the prim mount is the jaw\'s face"',
        "    kilogramsPerUnit = 1",
        "    metersPerUnit = 1",
        '    upAxis = "Z"',
        ")",
        "",
        *_finger(finger),
    ]
    return ("\n".join(lines) + "\n").encode()


def _finger(finger: RobotFinger) -> Iterator[str]:
    moments, axes = finger.mass.principal()
    yield 'def Xform "finger" ('
    yield '    prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"]'
    yield '    kind = "component"'
    yield ")"
    yield "{"
    yield f"    point3f physics:centerOfMass = {_vector(finger.mass.centre_m)}"
    yield f"    float3 physics:diagonalInertia = {_vector(moments)}"
    yield f"    float physics:mass = {rounded(finger.mass.mass_kg)}"
    yield f"    quatf physics:principalAxes = {_vector(quaternion_wxyz(axes))}"
    yield from _indented(_materials(finger))
    for number, piece in enumerate(finger.visuals):
        yield from _indented(_visual(piece, number))
    for piece in finger.collisions:
        yield from _indented(_collision(piece))
    yield from _indented(_frame("mount", np.eye(4)))
    yield from _indented(_frame("gel", finger.frames.gel))
    yield from _indented(_frame("camera_optical", finger.frames.optical))
    yield from _indented(_camera(finger))
    yield "}"


def _materials(finger: RobotFinger) -> Iterator[str]:
    yield 'def Scope "materials"'
    yield "{"
    for number, piece in enumerate(finger.visuals):
        path = f"/finger/materials/colour_{number}"
        *colour, opacity = piece.colour
        yield f'    def Material "colour_{number}"'
        yield "    {"
        yield f"        token outputs:surface.connect = <{path}/surface.outputs:surface>"
        yield '        def Shader "surface"'
        yield "        {"
        yield '            uniform token info:id = "UsdPreviewSurface"'
        yield f"            color3f inputs:diffuseColor = {_vector(colour)}"
        yield f"            float inputs:opacity = {rounded(opacity)}"
        yield "            token outputs:surface"
        yield "        }"
        yield "    }"
    yield '    def Material "gel_contact" ('
    yield '        prepend apiSchemas = ["PhysicsMaterialAPI"]'
    yield "    )"
    yield "    {"
    yield f"        float physics:dynamicFriction = {rounded(finger.contact.friction)}"
    yield "        float physics:restitution = 0"
    yield f"        float physics:staticFriction = {rounded(finger.contact.friction)}"
    yield f"        custom double gelslim:stiffness_n_m = {rounded(finger.contact.stiffness_n_m)}"
    yield f"        custom double gelslim:damping_n_s_m = {rounded(finger.contact.damping_n_s_m)}"
    yield "    }"
    yield "}"


def _visual(piece: Piece, number: int) -> Iterator[str]:
    yield f'def Mesh "{piece.name}" ('
    yield '    prepend apiSchemas = ["MaterialBindingAPI"]'
    yield ")"
    yield "{"
    yield from _mesh(piece)
    yield f"    rel material:binding = </finger/materials/colour_{number}>"
    yield "}"


def _collision(piece: Piece) -> Iterator[str]:
    gel = piece.name == "collision_gel"
    binding = ', "MaterialBindingAPI"' if gel else ""
    yield f'def Mesh "{piece.name}" ('
    yield (f'    prepend apiSchemas = ["PhysicsCollisionAPI", "PhysicsMeshCollisionAPI"{binding}]')
    yield ")"
    yield "{"
    yield from _mesh(piece)
    yield '    uniform token physics:approximation = "convexHull"'
    yield '    uniform token purpose = "guide"'
    if gel:
        yield "    rel material:binding:physics = </finger/materials/gel_contact>"
    yield "}"


def _mesh(piece: Piece) -> Iterator[str]:
    vertices, faces = piece.mesh.vertices_mm * 1e-3, piece.mesh.faces
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    yield f"    float3[] extent = [{_vector(low)}, {_vector(high)}]"
    yield f"    int[] faceVertexCounts = [{', '.join(['3'] * len(faces))}]"
    yield f"    int[] faceVertexIndices = [{', '.join(map(str, faces.ravel().tolist()))}]"
    yield '    uniform token orientation = "rightHanded"'
    points = (
        f"({x:.{MESH_DIGITS}g}, {y:.{MESH_DIGITS}g}, {z:.{MESH_DIGITS}g})"
        for x, y, z in (vertices + 0.0).tolist()
    )
    yield f"    point3f[] points = [{', '.join(points)}]"
    yield '    uniform token subdivisionScheme = "none"'


def _frame(name: str, at: Transform) -> Iterator[str]:
    yield f'def Xform "{name}"'
    yield "{"
    yield from _placed(at)
    yield "}"


def _camera(finger: RobotFinger) -> Iterator[str]:
    """The camera; apertures stand to the focal length as the picture's sides to that in px."""
    focal = finger.focal_length_mm
    width, height = (focal * side / finger.focal_px for side in finger.image_px)
    yield 'def Camera "camera"'
    yield "{"
    yield "    float2 clippingRange = (0.0005, 1)"
    yield f"    float focalLength = {rounded(focal)}"
    yield f"    float horizontalAperture = {rounded(width)}"
    yield '    token projection = "perspective"'
    yield f"    float verticalAperture = {rounded(height)}"
    yield from _placed(finger.frames.graphics)
    yield "}"


def _placed(at: Transform) -> Iterator[str]:
    yield f"    quatd xformOp:orient = {_vector(quaternion_wxyz(at[:3, :3]))}"
    yield f"    double3 xformOp:translate = {_vector(at[:3, 3])}"
    yield '    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:orient"]'


def _vector(values: NDArray[np.float64] | list[float]) -> str:
    return f"({rounded(values).replace(' ', ', ')})"


def _indented(lines: Iterator[str]) -> Iterator[str]:
    return (f"    {line}" for line in lines)


def _quoted(text: str) -> str:
    return re.sub(r'["\\]', "_", text)
