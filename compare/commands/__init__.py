"""The commands run, crosscheck, threshold and scenes; a list of all is in `compare/report/registry.py`."""
