"""Pictures of closed meshes, drawn off screen with VTK."""
