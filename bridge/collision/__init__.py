"""Collision detection for the blade and the arm: with tissue, fixtures and each other (FCL)."""
