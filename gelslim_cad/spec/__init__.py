"""The spec: a YAML file read into frozen, checked data."""

from gelslim_cad.spec.camera import Camera
from gelslim_cad.spec.design import Design
from gelslim_cad.spec.manufacturing import Manufacturing
from gelslim_cad.spec.material import Material
from gelslim_cad.spec.mesh import Mesh
from gelslim_cad.spec.spec import Spec

__all__ = ["Camera", "Design", "Manufacturing", "Material", "Mesh", "Spec"]
