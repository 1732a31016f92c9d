"""ROS 2 node of vision-based tactile fingers made with gelslim-cad."""
