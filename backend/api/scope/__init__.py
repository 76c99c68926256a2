"""Routes of scope set-ups, recordings, the rerun viewer and the 3D scene."""
