"""What the blade and the arm meet: the tissue, fixtures, and the arm itself (python-fcl)."""
