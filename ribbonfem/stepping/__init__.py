"""Time stepping of the planar beams."""
