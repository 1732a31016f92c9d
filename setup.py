"""The packages of the wheel: all rooms, and the designs as data of the package `gelslim`."""

from setuptools import find_packages, setup

PACKAGES = [
    f"{root}{ending}"
    for root in (
        "gelslim", "gelslim_cad", "gelslim_core", "gelslim_force", "gelslim_optics",
        "gelslim_twin", "ifem_export",
    )
    for ending in ("", ".*")
]  # fmt: skip
DESIGNS = {"gelslim.designs": "designs", "gelslim.designs.scenes": "designs/scenes"}

setup(
    packages=[*find_packages(include=PACKAGES), *DESIGNS],
    package_dir=DESIGNS,
    package_data={name: ["*.yaml", "*.csv", "*.stl"] for name in DESIGNS},
)
