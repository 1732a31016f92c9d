"""Where a network that learnt from drawn pictures finds the contact in pictures of a real sensor.

    GELSLIM_REAL_FRAMES=frames python -m bench.learning.real_locations

Writes docs/data/real_locations.json in two minutes of CPU time. The frames, of a GelSlim 3.0,
belong to others and are not in the project (tests/force/real_frames). Needs scikit-learn.

The truth is the middle of the coloured imprint, read off each picture twice by eye. The twin gets
the picture at rest and plain values of the design, and never a press. The same contacts are drawn
in two ways: with the look of the sensor at rest, and with even light and plain ink. The gain of the
shading, which a picture at rest does not show, is drawn from a wide range.
"""

from __future__ import annotations

import argparse
import itertools
from collections.abc import Iterator, Mapping, Sequence
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.bench_data import see_tests, write_data
from bench.rigs.machine import machine

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]
SEED = 11
SAMPLES, HELD_OUT = (600, 150), 100
GAINS = (0.6, 1.0, 1.5, 2.2, 3.2)
"""Gains of the shading; a press is drawn with one of them."""
RADII_MM, DEPTHS_MM = (2.0, 3.0, 4.0, 5.5, 7.5), (0.3, 1.2)
MARGIN_MM = 2.0
"""How close to the edge of the picture the middle of a contact comes."""
CELL_PX = 16
READINGS_PX: Mapping[str, tuple[tuple[float, float], tuple[float, float]]] = {
    "press_5": ((245, 240), (250, 240)),
    "press_14": ((117, 142), (114, 143)),
    "press_18": ((243, 250), (245, 250)),
    "press_26": ((284, 156), (287, 155)),
    "press_33": ((215, 52), (219, 49)),
    "press_38": ((141, 130), (146, 129)),
    "press_44": ((227, 163), (233, 166)),
    "press_49": ((227, 193), (226, 195)),
}
"""Middle of the imprint (x, y) in each press, read twice and independently."""


def main() -> None:
    """Draw contacts, train, judge on the real presses, write the figures."""
    argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    ).parse_args()
    see_tests("twin", "force", "force/real_frames")
    from real_looks import picture, seen

    rest, grid = seen("gelslim3/reference.jpg")
    presses = {name: picture(f"gelslim3/{name}.jpg") for name in READINGS_PX}
    contacts = Contacts(rest, SAMPLES[0] + HELD_OUT)
    readings = np.array(list(READINGS_PX.values()), dtype=float)
    truth = readings.mean(axis=1)
    apart = np.linalg.norm(readings[:, 0] - readings[:, 1], axis=1)
    real = np.array([changes(image, rest.picture) for image in presses.values()])
    learned = [
        {"look": look, **row}
        for look, renderers in looks(rest, grid).items()
        for row in networks(contacts, contacts.drawn(renderers), real, truth)
    ]
    data = {
        **machine(SEED),
        "presses": len(truth),
        "px_per_mm": contacts.per_mm,
        "readings_apart_mm": float(np.sqrt(np.mean((apart / contacts.per_mm) ** 2))),
        "without": untrained(contacts, presses, rest.picture, truth),
        "learned": learned,
    }
    write_data("real_locations", data)
    print(table(data))


def untrained(
    contacts: Contacts, presses: Mapping[str, Picture], rest: Picture, truth: Array
) -> dict[str, Any]:
    """Errors of what learns nothing, on the real presses, by its name."""
    found = {
        "the middle of the picture, always": np.broadcast_to(contacts.middle_px, truth.shape),
        "centroid of the change, no training": np.array(
            [centroid(image, rest) for image in presses.values()]
        ),
        "imprint found by the force pipeline": np.array(list(patches(presses, rest))),
    }
    return {name: errors(places, truth, contacts.per_mm) for name, places in found.items()}


def networks(
    contacts: Contacts,
    drawn: Array,
    real: Array,
    truth: Array,
) -> Iterator[dict[str, Any]]:
    """Errors of networks that learn from drawn changes, on those held out and on real ones."""
    places = contacts.places_px
    for scaled, count in itertools.product((False, True), SAMPLES):
        taught, met = (unit(drawn), unit(real)) if scaled else (drawn, real)
        model = network(taught[:count], places[:count])
        yield {
            "unit": scaled,
            "samples": count,
            "drawn": errors(model(taught[-HELD_OUT:]), places[-HELD_OUT:], contacts.per_mm),
            "real": errors(model(met), truth, contacts.per_mm),
        }


class Contacts:
    """Balls pressed anywhere into the pad of the real sensor, as the twin solves them."""

    def __init__(self, rest: Any, count: int) -> None:
        """Draw and solve `count` contacts of a pad with the size and thickness of `real_looks`."""
        from test_real_unknown_shape import GEL, THICKNESS_MM

        import gelslim
        from gelslim_twin.render.surface_state import SurfaceState
        from ifem_export.bundle.bundle import build_bundle
        from ifem_export.bundle.files import write_bundle
        from ifem_export.mesh.outline import RoundedRectangle
        from ifem_export.mesh.pad_mesh import build_pad_mesh

        self._rest = rest
        size = np.array([rest.pad.length_mm, rest.pad.width_mm])
        cells = (*np.rint(size / 0.7).astype(int), 4)
        mesh, _ = build_pad_mesh(RoundedRectangle(*size, 1.0), THICKNESS_MM, cells=cells)
        random = np.random.default_rng(SEED)
        half = size / 2 - MARGIN_MM
        self._places_mm = random.uniform(-half, half, (count, 2))
        self._gains = random.integers(0, len(GAINS), count)
        radii, depths_mm = (
            random.integers(0, len(RADII_MM), count),
            random.uniform(*DEPTHS_MM, count),
        )
        poses = np.tile(np.eye(4), (count, 1, 1))
        poses[:, :2, 3] = self._places_mm
        poses[:, 2, 3] = np.take(RADII_MM, radii) - depths_mm
        moved = np.empty((count, len(mesh.surface), 3))
        with TemporaryDirectory() as folder:
            write_bundle(folder, build_bundle(mesh, GEL, "bbar", with_stiffness=False))
            for k, radius_mm in enumerate(RADII_MM):
                twin = gelslim.Twin(folder, effects={"nonlinearity": "off"}, keep=f"{folder}/kept")
                twin.add(gelslim.Body.sphere(radius_mm))
                solved = twin.batch(poses[radii == k])
                solved.require_solved()
                moved[radii == k] = solved.displacement_mm
            self._states = [SurfaceState.from_nodes(twin.points_mm, u) for u in moved]

    @property
    def per_mm(self) -> float:
        """Pixels per millimetre of the gel, as assumed."""
        return float(self._rest.picture.shape[1] / self._rest.pad.length_mm)

    @property
    def middle_px(self) -> Array:
        """The middle (x, y) of the picture."""
        return (np.array(self._rest.picture.shape[1::-1]) - 1) / 2

    @property
    def places_px(self) -> Array:
        """Middles (n, 2) of the contacts in the picture."""
        at_surface = np.column_stack([self._places_mm, np.zeros(len(self._places_mm))])
        return np.asarray(self._rest.camera.project(at_surface))

    def drawn(self, renderers: Sequence[Any]) -> Array:
        """Changes (n, cells) of the drawn pictures, each with the renderer of its gain."""
        rests = [renderer.frame().image for renderer in renderers]
        found = []
        for k, (state, gain) in enumerate(zip(self._states, self._gains, strict=True), 1):
            image = renderers[gain].frame(state, number=k).image
            found.append(changes(image, rests[gain]))
        return np.array(found)


def looks(rest: Any, grid: Any) -> dict[str, list[Any]]:
    """Renderers of each gain: with the look of the sensor at rest, and with plain light and ink."""
    from gelslim_twin.appearance.calibrate_look import renderers
    from gelslim_twin.appearance.fit_look import fit_look

    fitted, plain = [], []
    for gain in GAINS:
        terms = np.zeros((3, 6))
        terms[:, 0] = gain
        look = fit_look(rest, shading_gain=terms).look
        fitted.append(renderers(look, rest, grid)[0])
        plain.append(renderers(evened(look), rest, grid)[0])
    return {"look of the sensor": fitted, "even light, plain ink": plain}


def evened(look: Any) -> Any:
    """The look with a bare picture of one grey value, as of a design without faults."""
    from dataclasses import replace

    level = np.median(look.bare.reshape(-1, 3), axis=0).mean()
    return replace(look, bare=np.full_like(look.bare, np.uint8(level)))


def changes(image: Picture, rest: Picture) -> Array:
    """How much brighter or darker each cell of 16 x 16 px is than at rest, per colour."""
    return (_cells(image) / _cells(rest) - 1).ravel()


def unit(found: Array) -> Array:
    """Changes (n, cells) of length 1, whatever the depth and the strength of the light."""
    return np.asarray(found / np.linalg.norm(found, axis=1, keepdims=True))


def _cells(image: Picture) -> Array:
    rows, columns = (size // CELL_PX for size in image.shape[:2])
    cut = image[: rows * CELL_PX, : columns * CELL_PX].astype(float)
    return cut.reshape(rows, CELL_PX, columns, CELL_PX, 3).mean(axis=(1, 3)) + 5


def network(features: Array, places_px: Array) -> Any:
    """The network of examples/train_regressor.py, without forces: a function to places (n, 2)."""
    from sklearn.decomposition import PCA
    from sklearn.ensemble import BaggingRegressor
    from sklearn.neural_network import MLPRegressor
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    member = make_pipeline(
        PCA(min(30, len(features) // 3), random_state=0),
        StandardScaler(),
        MLPRegressor(hidden_layer_sizes=(128, 64), alpha=1.0, max_iter=1500, random_state=0),
    )
    scale = StandardScaler().fit(places_px)
    model = BaggingRegressor(member, n_estimators=5, bootstrap=False, random_state=0)
    model.fit(features, scale.transform(places_px))
    return lambda seen: scale.inverse_transform(model.predict(seen))


def centroid(image: Picture, rest: Picture) -> Array:
    """Centroid (x, y) in px of the cells that changed by more than half of the largest change."""
    rows, columns = (size // CELL_PX for size in image.shape[:2])
    size = np.linalg.norm(changes(image, rest).reshape(rows, columns, 3), axis=2)
    y, x = np.nonzero(size > size.max() / 2)
    return CELL_PX * (np.average(np.column_stack([x, y]), axis=0, weights=size[y, x]) + 0.5) - 0.5


def patches(presses: Mapping[str, Picture], rest: Picture) -> Any:
    """Middles (x, y) in px of the imprints that the force pipeline finds without a camera."""
    from gelslim_force.contact.patch_finder import PatchFinder
    from gelslim_force.detection.detection import Detector
    from gelslim_force.detection.settings import DetectorSettings
    from gelslim_optics.camera.virtual_camera import Layer, VirtualCamera

    height, width = rest.shape[:2]
    camera = VirtualCamera(
        np.array([0.0, 0.0, -1000.0]), *np.eye(3), focal_px=1000.0, image_width_px=width,
        image_height_px=height, window_bottom_z_mm=-1.0, layers=(Layer(1.0, 1.0),),
    )  # fmt: skip
    detector = Detector(DetectorSettings(shape="double"))
    dots = detector.detect(rest)
    radius = 1.6 * np.sqrt(dots.area_px / np.pi)
    finder = PatchFinder(camera, rest, dots.centres_px, marker_radius_px=radius)
    for image in presses.values():
        patch = finder.find(image, detector.detect(image).centres_px)
        assert patch is not None
        yield patch.centre_mm + (np.array([width, height]) - 1) / 2


def errors(found_px: Array, truth_px: Array, per_mm: float) -> dict[str, Any]:
    """Median, 95th percentile and largest distance in mm, mean offset (x, y), each of few."""
    off = (np.asarray(found_px) - truth_px) / per_mm
    away = np.linalg.norm(off, axis=1)
    few = {"each_mm": away.round(3).tolist()} if len(away) < HELD_OUT else {}
    return {
        "median_mm": float(np.median(away)),
        "most_mm": float(np.quantile(away, 0.95)),
        "largest_mm": float(away.max()),
        "offset_mm": off.mean(axis=0).tolist(),
        **few,
    }


def table(data: Mapping[str, Any]) -> str:
    """The table of docs/train.md."""
    lines = [
        "| what finds the place | pictures learnt from | drawn, median (95 %) "
        "| real, median (largest) |",
        "|---|---:|---:|---:|",
    ]
    for name, row in data["without"].items():
        lines.append(f"| {name} | – | – | {row['median_mm']:.2f} mm ({row['largest_mm']:.2f} mm) |")
    for row in data["learned"]:
        kind = ", scaled to length 1" if row["unit"] else ""
        drawn, real = row["drawn"], row["real"]
        lines.append(
            f"| network, {row['look']}{kind} | {row['samples']} "
            f"| {drawn['median_mm']:.2f} mm ({drawn['most_mm']:.2f} mm) "
            f"| {real['median_mm']:.2f} mm ({real['largest_mm']:.2f} mm) |"
        )
    lines += [
        "",
        f"The two readings of a picture are {data['readings_apart_mm']:.2f} mm apart (root mean "
        f"square of {data['presses']}).",
    ]
    return "\n".join(lines)


if __name__ == "__main__":
    main()
