"""Builds a finger: every file of a spec, proved as written, swapped in whole."""

from gelslim_cad.build.variant import BuildRefusedError, BuildResult, build_variant

__all__ = ["BuildRefusedError", "BuildResult", "build_variant"]
