"""Outputs of the force pipeline: run folders, pictures, videos, ROS 2 recordings, live views."""
