"""The camera of a scene, put together from the optical effects that a plan keeps."""
