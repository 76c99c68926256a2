"""Load of a repeated motion on a motor: effective torque, braking energy, heat."""
