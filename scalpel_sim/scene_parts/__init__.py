"""What scenes are made of: the names that their settings may have, and specimens of materials."""
