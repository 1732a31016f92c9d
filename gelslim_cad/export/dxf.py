"""DXF documents (R2010, mm) whose bytes depend on their drawing alone."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

_MILLIMETRES = 4


def new_document() -> Any:
    """Start an `ezdxf` R2010 document in mm."""
    import ezdxf

    with _fixed_metadata():
        document = ezdxf.new("R2010")
    document.header["$INSUNITS"] = _MILLIMETRES
    document.header["$MEASUREMENT"] = 1
    return document


def document_bytes(document: Any) -> bytes:
    """Write a document with constant dates and identifiers, the same in every process."""
    # ezdxf lists the classes in use in the order of a set of strings, which differs between
    # processes; those added before keep their order.
    for name in sorted(document.entitydb.dxf_types_in_use()):
        document.classes.add_class(name)
    stream = io.StringIO()
    with _fixed_metadata():
        document.write(stream)
    return stream.getvalue().encode("utf-8")


@contextmanager
def _fixed_metadata() -> Iterator[None]:
    import ezdxf

    before = ezdxf.options.write_fixed_meta_data_for_testing
    ezdxf.options.write_fixed_meta_data_for_testing = True
    try:
        yield
    finally:
        ezdxf.options.write_fixed_meta_data_for_testing = before
