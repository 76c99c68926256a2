"""What a repeated motion asks of a motor: effective torque, braking energy, heat."""
