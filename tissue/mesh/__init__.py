"""The topology container: the body's arrays, and what is looked up in them."""
