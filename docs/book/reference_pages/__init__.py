"""The generated pages of the reference, one module per subject; see generate_reference.py."""
