"""ZIP archives whose bytes repeat."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping

EPOCH = (1980, 1, 1, 0, 0, 0)
"""The time that an archive gives its files, so that its bytes repeat."""


def archive(files: Mapping[str, bytes]) -> bytes:
    """A ZIP archive, stored without compression, whose bytes depend on the files alone.

    Args:
        files: Contents by path in the archive.

    Returns:
        The archive, its files in the order of their paths.
    """
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w", zipfile.ZIP_STORED) as packed:
        for name, content in sorted(files.items()):
            info = zipfile.ZipInfo(name, EPOCH)
            info.create_system = 3
            info.external_attr = 0o644 << 16
            packed.writestr(info, content)
    return data.getvalue()
