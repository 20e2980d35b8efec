"""The blade in the tissue: its edge, which cuts, and its faces, which press and rub."""
