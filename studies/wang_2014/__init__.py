"""Wang et al. 2014: positioning by a sampled dual loop and a learned screw table."""
