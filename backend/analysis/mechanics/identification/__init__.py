"""Model of mechanics fitted to measured responses: trials, fit, modes and uncertainty."""
