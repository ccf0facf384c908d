"""The image as an outsider builds and runs it: `make test-image` (buildah, debootstrap)."""
