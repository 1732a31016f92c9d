"""The spec: a YAML file read into frozen, checked data."""

from gelslim_cad.spec.camera import Camera
from gelslim_cad.spec.design import Design
from gelslim_cad.spec.spec import Manufacturing, Material, Mesh, Spec
from gelslim_cad.spec.tolerance import Tolerance

__all__ = ["Camera", "Design", "Manufacturing", "Material", "Mesh", "Spec", "Tolerance"]
