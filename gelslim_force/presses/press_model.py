"""What a press of a ball should show, as a function of gel, ball and place, and its derivatives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gelslim_force.forces.estimator import surface_share_mm2
from gelslim_force.layer.ball_on_layer import BallOnLayer
from gelslim_force.motion.marker_motion import MarkerView
from gelslim_force.motion.printed_dots import PrintedDots
from gelslim_force.presses.radial_motion import RadialMotion
from gelslim_force.presses.seen_press import PressView, SeenPress
from gelslim_force.settings import PipelineSettings
from ifem_export.markers.interpolation import marker_to_node

Array = NDArray[np.float64]
FRICTION = 0.3
"""Standard deviation of each part of the tangential traction over the pressure."""
_RIM_POINTS = 24
_REACH = 4.0
"""Distance beyond the rim, in thicknesses, up to which markers count."""
_STEPS = (1e-3, 1e-4, 1e-3, 0.02, 1e-3, 1e-3, 1e-3)
"""Of ln thickness, Poisson's ratio, ln ball, skin, ln contact, x and y for finite differences."""
_SMALL_MM = 1e-4
"""Motion for the derivative of a dot's place in the picture."""
_RADIAL, _FRICTION_STEP = (2, 6), 0.01
"""Parts of the friction that are radial, see `_fields`, and their step."""
GEL, LOCAL = 4, 3
"""Parameters of gel and ball (ln thickness, ratio, ln ball, skin as in `skin_parameter`) and of a
press (ln contact, x, y)."""


@dataclass(frozen=True, eq=False)
class Expected:
    """What a press should show.

    Attributes:
        log_force: Logarithm of the force over Young's modulus.
        rim_mm: Radius of the patch as seen: the rim moves outwards with the gel, and with friction.
        depth_mm: Of the ball.
        markers_px: (m, 2) displacement in the picture of the centroids of the near markers' dots.
    """

    log_force: float
    rim_mm: float
    depth_mm: float
    markers_px: Array


@dataclass(frozen=True, eq=False)
class Linearised:
    """What a press should show, and its derivatives by n parameters.

    Attributes:
        base: What shows.
        log_force: (n,) derivatives of the logarithm of the force.
        rim_mm: (n,) of the radius of the patch.
        markers_px: (m, 2, n) of the markers.
    """

    base: Expected
    log_force: Array
    rim_mm: Array
    markers_px: Array


class PressModel:
    """The model of one press, near the place where it is seen.

    The gel strains the printed dots: what shows is the centroid of each strained dot.

    Friction between ball and gel is not known: it adds tangential tractions that are the pressure
    times 1, x, y and a cubic term, whose sizes are free within `FRICTION`. The two radial ones also
    change the force and the depth of the contact.

    Args:
        view: The sensor.
        seen: The press.
        young_mpa: Young's modulus of the design.

    Attributes:
        seen: As given.
        near: (m,) markers near the press that are seen.
        friction_px: (m, 2, t) displacement of these markers by each tangential traction that is not
            radial; 0 for the radial ones, which the contact contains.
        friction_rim_mm: (t,) motion of the rim outwards by each.
    """

    def __init__(self, view: PressView, seen: SeenPress, young_mpa: float) -> None:
        self.seen, self._ball_mm = seen, view.ball_mm
        self._thickness_mm = view.thickness_mm
        rest = view.markers.rest_mm
        away = np.hypot(*(rest[:, :2] - seen.patch.centre_mm).T)
        reach = seen.patch.size_mm + _REACH * view.thickness_mm
        self.near = np.flatnonzero((away < reach) & np.isfinite(seen.markers_px).all(axis=1))
        self._dots = PrintedDots(view.markers.camera, rest[self.near], view.diameter_mm[self.near])
        self.friction_px, self.friction_rim_mm = self._friction(view, young_mpa)

    @property
    def seen_px(self) -> Array:
        """(m, 2) displacement of the near markers as seen."""
        return self.seen.markers_px[self.near]

    def moved_px(self, markers: MarkerView) -> Array:
        """(m, 2) displacement of the near markers as seen from their places at rest."""
        return np.asarray(self.seen.markers_px[self.near] - markers.reference_px[self.near])

    def start(self) -> Array:
        """(3,) logarithm of the radius of contact, x and y as the picture shows them."""
        return np.array([np.log(self.seen.patch.size_mm), *self.seen.patch.centre_mm])

    def expected(self, gel: Array, local: Array, friction: Array) -> Expected:
        """What shows for gel and ball (4,), a press (3,) and its friction (t,).

        Raises:
            ValueError: The values are impossible.
        """
        contact = BallOnLayer.at(
            float(np.exp(local[0])),
            self._ball_mm * float(np.exp(gel[2])),
            self._thickness_mm * float(np.exp(gel[0])),
            float(gel[1]),
            (float(friction[_RADIAL[0]]), float(friction[_RADIAL[1]])),
            skin_length_mm(float(gel[3]), self._thickness_mm),
        )
        offset = self._dots.rims_mm[..., :2] - local[1:]
        motion = RadialMotion.of(contact, float(np.hypot(offset[..., 0], offset[..., 1]).max()))
        moved = motion.rim_outward_mm + float(self.friction_rim_mm @ friction)
        return Expected(
            float(np.log(contact.force_n_per_mpa)),
            contact.contact_mm + moved,
            contact.depth_mm,
            self._dots.shift_px(motion.at(offset)) + self.friction_px @ friction,
        )

    def linearised(self, gel: Array, local: Array, friction: Array) -> Linearised:
        """What shows, and its derivatives by the 7 + t parameters: `GEL`, `LOCAL`, friction."""
        base = self.expected(gel, local, friction)
        every = np.concatenate([gel, local, friction])
        force, rim = np.zeros(len(every)), np.zeros(len(every))
        markers = np.zeros((*base.markers_px.shape, len(every)))
        own = GEL + LOCAL
        rim[own:], markers[..., own:] = self.friction_rim_mm, self.friction_px
        steps = dict(enumerate(_STEPS)) | {own + k: _FRICTION_STEP for k in _RADIAL}
        for k, step in steps.items():
            moved = every.copy()
            # Poisson's ratio stays below 0.5.
            size = -step if k == 1 else step
            moved[k] += size
            found = self.expected(moved[:GEL], moved[GEL:own], moved[own:])
            force[k] = (found.log_force - base.log_force) / size
            rim[k] = (found.rim_mm - base.rim_mm) / size
            markers[..., k] = (found.markers_px - base.markers_px) / size
        return Linearised(base, force, rim, markers)

    def _friction(self, view: PressView, young_mpa: float) -> tuple[Array, Array]:
        """Responses to the tangential tractions, from the pad's operator as designed."""
        bundle, patch = view.bundle, self.seen.patch
        points = np.asarray(bundle.mesh.surface_mm)
        ratio = bundle.material.poissons_ratio
        contact = BallOnLayer.at(patch.size_mm, self._ball_mm, self._thickness_mm, ratio)
        offset = (points[:, :2] - patch.centre_mm) / patch.size_mm
        pressure = young_mpa * contact.pressure(patch.size_mm * np.hypot(*offset.T))
        force = (pressure * surface_share_mm2(bundle.mesh))[:, None] * _fields(offset)
        operator = PipelineSettings().compliance(bundle)
        moved = [
            operator.displacement(np.column_stack([part, np.zeros(len(points))])) for part in force
        ]
        lateral = [self._seen(points, m) for m in moved]
        turn = np.linspace(0, 2 * np.pi, _RIM_POINTS, endpoint=False)
        unit = np.column_stack([np.cos(turn), np.sin(turn)])
        to_rim = marker_to_node(points, patch.centre_mm + patch.size_mm * unit)
        rim = [float(((to_rim @ m)[:, :2] * unit).sum(axis=1).mean()) for m in moved]
        by_marker, by_rim = np.stack(lateral, axis=-1), np.array(rim)
        # The contact itself has the radial parts, in closed form.
        by_marker[..., _RADIAL], by_rim[list(_RADIAL)] = 0.0, 0.0
        return by_marker, by_rim

    def _seen(self, points_mm: Array, motion_mm: Array) -> Array:
        """(m, 2) displacement of the dots by a small lateral motion (c, 3) of surface nodes."""
        rims = self._dots.rims_mm
        moved = marker_to_node(points_mm, rims.reshape(-1, 3)) @ motion_mm
        moved[:, 2] = 0.0
        small = _SMALL_MM / max(float(np.abs(moved).max()), 1e-12)
        return self._dots.shift_px(small * moved.reshape(rims.shape)) / small


def skin_parameter(plane_mm: float, thickness_mm: float) -> float:
    """The skin as an unknown: ln(1 + T/(E h)) of a skin of T/E on a layer of h.

    It is linear in a soft skin and logarithmic in a stiff one, whose stiffness matters no more.
    """
    return float(np.log1p(plane_mm / thickness_mm))


def skin_length_mm(parameter: float, thickness_mm: float) -> float:
    """Plane stiffness of the skin over Young's modulus of the gel, T/E; see `skin_parameter`."""
    return thickness_mm * float(np.expm1(parameter))


def _fields(offset: Array) -> Array:
    """(t, c, 2) directions of traction at offsets (c, 2) over the radius of the patch."""
    x, y = offset.T
    one, zero, square = np.ones_like(x), np.zeros_like(x), x * x + y * y
    pairs = ((one, zero), (zero, one), (x, y), (-y, x), (x, -y), (y, x), (square * x, square * y))
    return np.array([np.column_stack(pair) for pair in pairs])
