"""Names that become folders and files on any system."""

from __future__ import annotations

from gelslim_core.yaml.errors import FieldError

_DEVICES = {"con", "prn", "aux", "nul"} | {f"{p}{k}" for p in ("com", "lpt") for k in range(1, 10)}


def require_folder_name(field: str, name: str) -> None:
    """Raise FieldError for a name that Windows keeps for devices or would cut short.

    Windows reserves these with any ending too, and drops a dot at the end.
    """
    if name.partition(".")[0].lower() in _DEVICES:
        raise FieldError(field, f"{name} is the name of a device on Windows", "choose another name")
    if name.endswith("."):
        raise FieldError(field, f"{name} ends with a dot, which Windows drops", "leave the dot out")
