"""The live page, the replay, and the scene that both show."""
