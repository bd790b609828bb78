"""A second plant, pilot and set of instruments, written apart from the simulator, and cases drawn and flown with them.

What it assumes where published facts are silent, and its effects, stand in docs/elsewhere.md.
"""
