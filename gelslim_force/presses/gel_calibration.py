"""The gel of one built sensor: modulus, thickness, Poisson's ratio and skin as presses show them.

Stored as JSON, format `gelslim-gel-calibration/1`.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gelslim_core.files.json_record import RecordFile
from gelslim_force.calibration.sensor_calibration import Calibration
from gelslim_force.presses.press_error import PressError
from ifem_export.elements.skin import restiffened

if TYPE_CHECKING:
    from ifem_export.bundle.bundle import Bundle

Array = NDArray[np.float64]
FORMAT = "gelslim-gel-calibration/1"
PARAMETERS = ("ln_youngs_modulus", "ln_thickness", "poissons_ratio", "skin_n_per_mm")
"""Order of the covariance; the last only where the skin was fitted."""
_VALUES = ("youngs_modulus_mpa", "thickness_mm", "poissons_ratio", "skin_n_per_mm")
_MAKE = "make it with `gelslim calibrate-gel BUNDLE PRESSES LOADS.csv --ball-mm D -o FILE`"
_THICKNESS_RATIO = 0.5, 2.0


@dataclass(frozen=True, eq=False)
class GelCalibration:
    """A gel as built.

    Attributes:
        geometry_hash: Of the bundle as designed.
        youngs_modulus_mpa: Young's modulus.
        thickness_mm: Thickness.
        poissons_ratio: Poisson's ratio.
        covariance: (p, p) of ln modulus, ln thickness, Poisson's ratio and, where it was fitted, of
            the skin: p = 3 or 4.
        design: The same as designed, by name.
        ball_mm: Diameter of the ball that was pressed; None for a gel as specified.
        presses: What was found of each press, as plain data.
        diagnosis: What was found, in sentences.
        warnings: What should be looked at before the calibration is trusted.
        skin_n_per_mm: Membrane stiffness of coat and fabric together, at least 0; None where it was
            not fitted and is that of the design.
        gel: Law of the gel that explains the presses, as `GelLaw.record_of` gives it.

    Raises:
        ValueError: A value is impossible, or the covariance is none.
    """

    geometry_hash: str
    youngs_modulus_mpa: float
    thickness_mm: float
    poissons_ratio: float
    covariance: Array
    design: Mapping[str, float]
    ball_mm: float | None
    presses: tuple[Mapping[str, Any], ...] = ()
    diagnosis: tuple[str, ...] = field(default=())
    warnings: tuple[str, ...] = field(default=())
    skin_n_per_mm: float | None = None
    gel: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        covariance = np.array(self.covariance, dtype=float)
        size = len(self.parameters)
        if covariance.shape != (size, size) or not np.isfinite(covariance).all():
            raise ValueError(f"covariance must be {size} x {size} numbers")
        least = np.linalg.eigvalsh((covariance + covariance.T) / 2)[0]
        if not np.allclose(covariance, covariance.T, atol=1e-12) or least < -1e-12:
            raise ValueError("covariance must be symmetric and positive")
        covariance.setflags(write=False)
        object.__setattr__(self, "covariance", covariance)
        for name in ("youngs_modulus_mpa", "thickness_mm", "ball_mm"):
            value = getattr(self, name)
            if value is not None and not (np.isfinite(value) and value > 0):
                raise ValueError(f"{name} = {value!r}: must be above 0")
        if not 0 <= self.poissons_ratio < 0.5:
            raise ValueError(f"poissons_ratio = {self.poissons_ratio!r}: must be in 0 ... 0.5")
        if self.skin_n_per_mm is not None and not 0 <= self.skin_n_per_mm < np.inf:
            raise ValueError(f"skin_n_per_mm = {self.skin_n_per_mm!r}: must be at least 0")

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names (p,) of what the covariance is of."""
        return PARAMETERS[: 3 if self.skin_n_per_mm is None else 4]

    @property
    def standard_deviation(self) -> Array:
        """(p,) of modulus in MPa, thickness in mm, Poisson's ratio, and skin in N/mm."""
        scale = np.array([self.youngs_modulus_mpa, self.thickness_mm, 1.0, 1.0])
        scale = scale[: len(self.parameters)]
        return np.asarray(scale * np.sqrt(np.diag(self.covariance)))

    def applied(self, bundle: Bundle, calibration: Calibration) -> tuple[Bundle, Calibration]:
        """The bundle with the gel as built, and the sensor's calibration for it.

        Args:
            bundle: The sensor as designed.
            calibration: Its camera, and its markers at rest.

        Raises:
            PressError: The gel calibration belongs to another sensor, or its thickness is not
                between half and twice that of the design.
            CalibrationError: The camera's calibration belongs to another sensor.
        """
        calibration.require_bundle(bundle)
        self.require_bundle(bundle)
        made = self.varied(bundle)
        return made, replace(calibration, geometry_hash=made.geometry_hash)

    def varied(
        self,
        bundle: Bundle,
        ln_thickness: float = 0.0,
        poissons_ratio: float = 0.0,
        skin_n_per_mm: float = 0.0,
    ) -> Bundle:
        """The bundle with the gel as built and a change of its parameters."""
        gel = replace(
            bundle.material,
            youngs_modulus_mpa=self.youngs_modulus_mpa,
            poissons_ratio=self.poissons_ratio + poissons_ratio,
        )
        ratio = self.thickness_mm / designed_thickness_mm(bundle)
        made = bundle.with_gel(gel, ratio * float(np.exp(ln_thickness)))
        if self.skin_n_per_mm is None:
            return made
        skin = restiffened(bundle.skin, max(self.skin_n_per_mm + skin_n_per_mm, 0.0))
        return replace(made, skin=skin)

    def require_bundle(self, bundle: Bundle) -> None:
        """Raise PressError for another sensor, or an impossible thickness."""
        if bundle.geometry_hash != self.geometry_hash:
            raise PressError(
                "sensor",
                f"the gel calibration belongs to a sensor of geometry {self.geometry_hash[:12]}, "
                f"the bundle to {bundle.geometry_hash[:12]}: {_MAKE}",
            )
        ratio = self.thickness_mm / designed_thickness_mm(bundle)
        low, high = _THICKNESS_RATIO
        if not low <= ratio <= high:
            raise PressError(
                "sensor",
                f"the gel calibration has a thickness of {self.thickness_mm:.3g} mm, {ratio:.2g} "
                f"times that of the design; {low:g} to {high:g} times can be used",
            )


def specified_gel(bundle: Bundle) -> GelCalibration | None:
    """The gel as specified, with the tolerances of its maker; None where the bundle has none."""
    known, material = bundle.tolerances, bundle.material
    if not any(known.values()):
        return None
    thickness_mm = designed_thickness_mm(bundle)
    young, ratio = material.youngs_modulus_mpa, material.poissons_ratio
    sigma = [
        known.get("youngs_modulus_mpa", 0.0) / young,
        known.get("thickness_mm", 0.0) / thickness_mm,
        known.get("poissons_ratio", 0.0),
    ]
    design = {
        "youngs_modulus_mpa": young, "thickness_mm": thickness_mm, "poissons_ratio": ratio,
    }  # fmt: skip
    covariance = np.diag(np.square(sigma))
    return GelCalibration(
        bundle.geometry_hash, young, thickness_mm, ratio, covariance, design, None
    )


def designed_thickness_mm(bundle: Bundle) -> float:
    """Thickness of a bundle's gel."""
    return float(bundle.mesh.layers * bundle.mesh.cell_size_mm[2])


def gel_calibration_record(found: GelCalibration) -> dict[str, Any]:
    """Return the calibration as numbers, strings, lists and dicts."""
    names = _VALUES[: len(found.parameters)]
    return {
        "format": FORMAT,
        "geometry_hash": found.geometry_hash,
        **{name: getattr(found, name) for name in names},
        "standard_deviation": dict(zip(names, found.standard_deviation.tolist(), strict=True)),
        "parameters": list(found.parameters),
        "covariance": found.covariance.tolist(),
        "design": dict(found.design),
        "ball_mm": found.ball_mm,
        "gel": dict(found.gel),
        "presses": [dict(press) for press in found.presses],
        "diagnosis": list(found.diagnosis),
        "warnings": list(found.warnings),
    }


def write_gel_calibration(found: GelCalibration, path: str | os.PathLike[str]) -> None:
    """Write a gel calibration; an earlier file is kept if writing fails.

    Args:
        found: What to write.
        path: File to write; its folder must exist.

    Raises:
        OSError: The file cannot be written.
    """
    _FILE.write(found, path)


def read_gel_calibration(path: str | os.PathLike[str]) -> GelCalibration:
    """Read a gel calibration.

    Args:
        path: File of `gelslim calibrate-gel`, or of `write_gel_calibration`.

    Returns:
        The calibration.

    Raises:
        PressError: There is no such file, or it is damaged or of another kind.
    """
    return _FILE.read(path)


def _calibration_of(record: Mapping[str, Any]) -> GelCalibration:
    skin = record.get("skin_n_per_mm")
    expected = PARAMETERS[: 3 if skin is None else 4]
    if tuple(record["parameters"]) != expected:
        raise ValueError(f"its parameters are not {', '.join(expected)}")
    return GelCalibration(
        str(record["geometry_hash"]),
        float(record["youngs_modulus_mpa"]),
        float(record["thickness_mm"]),
        float(record["poissons_ratio"]),
        np.array(record["covariance"], dtype=float),
        {str(name): float(value) for name, value in record["design"].items()},
        float(record["ball_mm"]),
        tuple(dict(press) for press in record["presses"]),
        tuple(str(line) for line in record["diagnosis"]),
        tuple(str(line) for line in record["warnings"]),
        None if skin is None else float(skin),
        dict(record.get("gel", {})),
    )


_FILE = RecordFile(
    FORMAT,
    "gel calibration",
    _MAKE,
    gel_calibration_record,
    _calibration_of,
    partial(PressError, "file"),
)
