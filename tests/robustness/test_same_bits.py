"""What is solved does not depend on what was asked before, to the last bit."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "twin"))
from sim_rig import small_sensor

from gelslim_twin.contact.compliance import SurfaceCompliance
from ifem_export.bundle_io import load_bundle


def test_columns_of_the_compliance_are_the_same_in_whatever_order(tmp_path: Path) -> None:
    """A simulation that goes on after a kill finds other columns made than one that was not."""
    bundle = load_bundle(small_sensor(tmp_path))
    whole = SurfaceCompliance(bundle)
    count = whole.nodes
    whole.require(np.arange(count))
    unit = np.eye(3 * count).reshape(count, 3, count, 3)
    full = np.stack([[whole.displacement(np.arange(count), u) for u in unit[k]] for k in (0, 57)])
    random = np.random.default_rng(5)
    for asked in (1, 3, 17, 64, 65):
        some = SurfaceCompliance(bundle)
        some.require(random.choice(count, asked, replace=False))
        some.require(np.array([0, 57]))
        found = [[some.displacement(np.array([k]), e[None]) for e in np.eye(3)] for k in (0, 57)]
        assert np.array_equal(np.array(found), full)
