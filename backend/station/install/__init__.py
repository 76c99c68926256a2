"""How a station starts with its computer: service, task, the first set-up of a box."""
