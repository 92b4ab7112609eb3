"""Measurements over many cases and configurations, each a command."""
