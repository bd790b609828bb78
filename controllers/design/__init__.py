"""Offline synthesis of control laws on the clean aircraft; nothing at run time imports it.

`python -m controllers.design lqr|lqg|h_infinity --out FILE` writes the tables that `controllers.laws` fly with.
"""
