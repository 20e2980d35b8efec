"""A scene: its parts, and from its file to them."""
