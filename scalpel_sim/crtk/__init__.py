"""An arm of a run by the conventions of CRTK: operating states, and the topics of ROS 2."""
