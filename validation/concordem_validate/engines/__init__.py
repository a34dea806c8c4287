"""Our engines. Each module translates a scenario and its start state, and raises Unsupported for what it cannot translate.

How to add one, in Python or by a command: `concordem_validate.registry`.
"""
