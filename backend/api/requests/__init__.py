"""What a route learns of a request: person, control of the axis, language, profile, time."""
