"""Jobs, the station's log, and a clock that only goes forward."""
