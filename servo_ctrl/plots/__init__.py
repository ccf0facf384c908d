"""PNG pictures: arrays come in, files go out. `matplotlib_agg` is the only file that imports matplotlib."""
