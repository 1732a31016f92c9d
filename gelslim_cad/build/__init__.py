"""Builds a finger: writes every file of a spec, checks it, and replaces the output folder."""

from gelslim_cad.build.variant import BuildRefusedError, BuildResult, build_variant

__all__ = ["BuildRefusedError", "BuildResult", "build_variant"]
