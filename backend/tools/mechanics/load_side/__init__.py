"""Load side: backlash, stiffness and transmission error between motor and second encoder."""
