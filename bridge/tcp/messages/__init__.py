"""The values inside the frames, one module for each kind of message.

Numbers travel as raw little-endian float64 and int64, so a result is the same bit for bit on both
sides. Only the description (JSON) and an error (UTF-8) are text. Nothing is
pickled. Decoding is not validation: every number is checked here, on the side that receives it.
"""
