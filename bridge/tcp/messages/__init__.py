"""The contents of messages: MessagePack maps, whose fields are those of the values they carry.

Arrays travel as raw little-endian bytes, so a result is the same bit for bit on both sides. Only an
error is plain UTF-8. Nothing is pickled. The receiving side checks every number here.
"""
