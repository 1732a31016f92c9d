"""Random specs that keep every rule become fingers whose parts, cable and wires lie apart."""

from __future__ import annotations

import pytest

from gelslim_cad.build.solid_checks import check_solids
from gelslim_cad.checks import check
from gelslim_cad.dimensions import derive
from gelslim_cad.solids.finger import finger_parts

from .legal_specs import sample

SEED = 16
FINGERS = 20
MOST_SPECS = 200


@pytest.mark.slow
def test_parts_of_random_legal_fingers_lie_apart() -> None:
    found: dict[int, list[str]] = {}
    for index in range(MOST_SPECS):
        drawn = sample(SEED, index)
        if drawn.kind == "wild":
            continue
        d = derive(drawn.spec)
        if any(c.status == "fail" for c in check(d)):
            continue
        parts = finger_parts(d)
        found[index] = [c.reason for c in check_solids(d, parts) if c.status != "pass"]
        for part in parts:
            made = part.as_made().solid
            assert made.isValid(), (index, part.name)
            assert len(made.Solids()) == 1, (index, part.name)
        if len(found) == FINGERS:
            break
    assert len(found) == FINGERS
    assert {index: faults for index, faults in found.items() if faults} == {}
