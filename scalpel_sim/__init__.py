"""A MuJoCo robot arm holds a scalpel, cuts soft tissue for real, and feels it. World frame."""
