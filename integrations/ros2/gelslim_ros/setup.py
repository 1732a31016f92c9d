"""Install the node and its launch file; gelslim-cad itself comes from pip."""

from setuptools import setup

NAME = "gelslim_ros"

setup(
    name=NAME,
    version="0.1.0",
    packages=[NAME],
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/launch", ["launch/force.launch.py"]),
    ],
    install_requires=["setuptools", "gelslim-cad[vision]"],
    zip_safe=True,
    license="MIT",
    entry_points={"console_scripts": [f"force = {NAME}.force_node:main"]},
)
