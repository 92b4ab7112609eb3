"""Campaigns of measurements (speed, accuracy, hard cases, other programs), each a command."""
