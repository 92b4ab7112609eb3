"""Line elements on scikit-fem."""
