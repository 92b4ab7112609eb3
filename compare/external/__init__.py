"""Adapters that run a `Scene` in Exudyn, PyElastica or AUTO-07p, one a file."""
