"""Jobs, the station's log, reading in a separate process, and loading of slow libraries."""
