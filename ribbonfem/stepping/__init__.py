"""Time integration of the finite elements: methods, step control, the common time loop."""
