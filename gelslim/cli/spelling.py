"""Signs that a terminal lacks, spelled out: ≥ becomes >= where the encoding has no ≥."""

from __future__ import annotations

import codecs

SPELLED = "gelslim-spelled"
"""Name of the error handler for text streams."""

_SPELLING = {
    "≥": ">=", "≤": "<=", "°": " deg", "²": "^2", "³": "^3", "·": "*", "×": "x", "π": "pi",
    "α": "alpha", "γ": "gamma", "θ": "theta", "ψ": "psi", "Φ": "Phi", "Δ": "delta ",
    "⌈": "ceil(", "⌉": ")", "⌊": "floor(", "⌋": ")",
}  # fmt: skip


def _spell(error: UnicodeError) -> tuple[str | bytes, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    missing = error.object[error.start : error.end]
    return "".join(_SPELLING.get(sign, "?") for sign in missing), error.end


codecs.register_error(SPELLED, _spell)
