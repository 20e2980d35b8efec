"""Other engines in the same rounds as this one: what runs, its process, and the adapters."""
