"""The contents of messages, one module for each of them.

Numbers travel as raw little-endian float64 and int64, so a result is the same bit for bit on both
sides. Only the description (JSON) and an error (UTF-8) are text. Nothing is pickled. The receiving
side checks every number here.
"""
