"""The marker print in every format, from one MarkerGrid."""

from gelslim_cad.markers.nodes import NearestNodes, nearest_nodes
from gelslim_cad.markers.outline import Outline
from gelslim_cad.markers.process import MARKING_PROCESSES, MarkingProcess
from gelslim_cad.markers.write import write_marker_files

__all__ = [
    "MARKING_PROCESSES",
    "MarkingProcess",
    "NearestNodes",
    "Outline",
    "nearest_nodes",
    "write_marker_files",
]
