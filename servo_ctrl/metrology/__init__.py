"""What a recording says of the machine: circles, contour error, ISO 230-2. No published figures."""
