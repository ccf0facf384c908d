"""Published measurements of real axes: their recordings, and nominal models from data sheets."""
