"""Line elements for scikit-fem: C1 Hermite, and Lagrange at Gauss-Lobatto points."""
