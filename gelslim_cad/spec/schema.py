"""The JSON Schema of the spec, by which editors check and complete the YAML."""

from __future__ import annotations

import gelslim_core.yaml.schema
from gelslim_cad.spec.spec import Spec

FORMAT = "gelslim-spec/1"


def schema_text() -> str:
    """The JSON Schema (draft 2020-12) of the spec as text, the same for the same program."""
    return gelslim_core.yaml.schema.schema_text(Spec, FORMAT)
