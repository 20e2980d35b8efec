"""Adapters of other engines: one file each, run in a process of the Python that has the engine.

Each defines one function of the file's own name that takes a body and a case and returns a
`PeerStepper`.

That Python need not have this project or its dependencies, only NumPy and the engine. So nothing
here imports the project, except `ours`, and all imports between these files are relative:
`__main__` loads this folder as a package of its own, without the packages around it.
"""
