"""Parts of the tables of TOML files.

values      what a key may hold
problems    what is wrong with a file, and where; which keys a kind of table has
text_files  reads text files and TOML files
key_texts   the meaning of each key, for help, templates and pages
"""
