"""Forces of an object of unknown shape in frames of a real sensor, where they are at hand.

No design of that sensor is published. Its field of view, thickness, stiffness and lights are taken
from the nearest plain values, and the camera as one that looks straight down without distortion.
The size of the forces is therefore not tested, but where they are and which way they point.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray
from test_real_frames import PRESSES, picture
from test_real_patches import SEEN

from gelslim_force.detection.detection import Detector
from gelslim_force.dot_tracking import DotsAtRest, dots_at_rest
from gelslim_force.joint.estimator import JointEstimator
from gelslim_force.joint.fit_state import JointForces
from gelslim_force.joint.light.view import LightView
from gelslim_force.joint.node_lattice import NodeLattice
from gelslim_force.joint.responses import Responses
from gelslim_force.joint.settings import JointSettings
from gelslim_force.motion.marker_motion import MarkerView
from gelslim_force.tracking.marker_noise import noise_px
from gelslim_force.tracking.matching import match
from gelslim_force.tracking.tracks import Tracks
from gelslim_optics.camera.virtual_camera import Layer, VirtualCamera
from gelslim_optics.light.light_map import LightMap
from ifem_export.bundle.bundle import build_bundle
from ifem_export.compliance.columns import SurfaceCompliance
from ifem_export.elements.material import Material
from ifem_export.markers.interpolation import marker_to_node
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import build_pad_mesh
from ifem_export.mesh.surface_lattice import neighbour_matrix, surface_share_mm2

pytestmark = pytest.mark.slow

Array = NDArray[np.float64]
SIZE_PX = (427, 320)
PX_PER_MM = SIZE_PX[0] / 27
THICKNESS_MM = 3.0
GEL = Material(0.147, 0.48, 1000.0)
LIGHT_TRAVELS_DEG = np.array([240.0, 0.0, 120.0])
"""Red comes from the lower right of the picture, green from the left, blue from the upper right."""
ELEVATION_DEG = 25.0
CROSSTALK = 0.1


@dataclass(frozen=True, eq=False)
class RealSensor:
    """The untouched gel, and an estimator for its frames."""

    rest: DotsAtRest
    estimator: JointEstimator

    def forces(self, name: str) -> tuple[JointForces | None, Tracks]:
        image = picture(f"gelslim3/{name}.jpg")
        dots = Detector(self.rest.settings).detect(image)
        tracks = match(self.rest.reference, dots.centres_px)
        noise = noise_px(self.rest.reference, tracks.displacement_px)
        frame = self.estimator.frame(image, tracks.positions_px, noise)
        return self.estimator.estimate(frame), tracks


@pytest.fixture(scope="module")
def sensor() -> RealSensor:
    return real_sensor()


def real_sensor() -> RealSensor:
    """GelSlim 3.0 with plain values in the place of its design."""
    image = picture("gelslim3/reference.jpg")
    rest = dots_at_rest(image)
    camera = straight_camera()
    length, width = (size / PX_PER_MM for size in SIZE_PX)
    outline = RoundedRectangle(length_mm=length, width_mm=width, corner_radius_mm=1.0)
    mesh, _ = build_pad_mesh(outline, THICKNESS_MM, cells=(28, 21, 3))
    points, cell = np.asarray(mesh.surface_mm), np.asarray(mesh.cell_size_mm[:2])
    lattice = NodeLattice.of(points, cell)
    view = MarkerView(camera, rest.reference.positions_px)
    to_markers = marker_to_node(points, view.rest_mm)
    radius = 1.6 * np.sqrt(rest.dots.area_px / np.pi)
    light = three_lights(length, width)
    bundle = build_bundle(mesh, GEL, "bbar", with_stiffness=False)
    return RealSensor(
        rest,
        JointEstimator(
            points,
            surface_share_mm2(mesh),
            neighbour_matrix(points, cell),
            lattice,
            Responses(SurfaceCompliance(bundle), to_markers, view.by_height()),
            view,
            to_markers,
            lattice.interpolation(view.rest_mm) - to_markers,
            lattice.nearest_node(view.rest_mm[:, :2]),
            view.by_height(),
            LightView(camera, image, rest.reference.positions_px, radius, lattice, light, 1.0),
            GEL.youngs_modulus_mpa,
            JointSettings(gamma=1.0),
        ),
    )


def straight_camera() -> VirtualCamera:
    return VirtualCamera(
        position_mm=np.array([0.0, 0.0, -1000.0]),
        right=np.array([1.0, 0.0, 0.0]),
        down=np.array([0.0, 1.0, 0.0]),
        forward=np.array([0.0, 0.0, 1.0]),
        focal_px=1000.0 * PX_PER_MM,
        image_width_px=SIZE_PX[0],
        image_height_px=SIZE_PX[1],
        window_bottom_z_mm=-THICKNESS_MM,
        layers=(Layer(THICKNESS_MM, 1.41),),
    )


def three_lights(length_mm: float, width_mm: float) -> LightMap:
    x, y = (np.linspace(-size / 2, size / 2, 3) for size in (length_mm, width_mm))
    colour = (1 - 2 * CROSSTALK) * np.eye(3) + CROSSTALK
    return LightMap(x, y, np.ones((3, 3, 3)), LIGHT_TRAVELS_DEG, np.full(3, ELEVATION_DEG), colour)


def test_rest_is_no_contact(sensor: RealSensor) -> None:
    found, _ = sensor.forces("reference")
    assert found is None


def test_presses_have_their_force_where_they_are(sensor: RealSensor) -> None:
    """All presses are of one ball and alike in size, and so are their forces."""
    normal = []
    for name in PRESSES:
        found, _ = sensor.forces(name)
        assert found is not None, name
        x, y, half = SEEN[name]
        middle = (np.array([x, y]) - (np.array(SIZE_PX) - 1) / 2) / PX_PER_MM
        points, push = sensor.estimator.points_mm[:, :2], -found.force_n[:, 2]
        assert np.hypot(*(push @ points / push.sum() - middle)) < 0.35 * half / PX_PER_MM, name
        away = np.hypot(*(points - middle).T)
        assert push[away > 1.5 * half / PX_PER_MM].sum() < 0.12 * push.sum(), name
        depth = -found.displacement_mm[:, 2]
        assert away[np.argmax(depth)] < half / PX_PER_MM, name
        assert 0.2 < depth.max() < 0.6 * THICKNESS_MM, name
        assert found.unexplained < 0.7, name
        normal.append(push.sum())
    assert np.max(normal) < 1.6 * np.min(normal)


def test_shear_points_where_the_dots_move(sensor: RealSensor) -> None:
    """Within 45°: the lens of that sensor, which is not known, shows depth as motion too."""
    for name in PRESSES:
        found, tracks = sensor.forces(name)
        assert found is not None, name
        x, y, half = SEEN[name]
        near = np.hypot(*(sensor.rest.reference.positions_px - [x, y]).T) < half
        motion = np.nanmean(tracks.displacement_px[near], axis=0)
        shear = found.force_n[:, :2].sum(axis=0)
        assert shear @ motion > 0.7 * np.hypot(*shear) * np.hypot(*motion), name
