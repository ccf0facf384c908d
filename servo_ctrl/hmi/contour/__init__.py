"""The Contour page: commanded and actual path, and the contour error of the last turn of each circle."""
