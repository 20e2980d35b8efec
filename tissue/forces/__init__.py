"""What acts on nodes and is no part of the body itself, and all of it in one list (`terms`)."""
