"""A tissue in another process: frames, messages, keys, server and client."""
