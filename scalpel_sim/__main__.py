"""`python -m scalpel_sim` is `scalpel-sim`."""

from scalpel_sim.cli.app import main

if __name__ == "__main__":
    main()
