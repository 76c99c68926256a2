"""HTTP and websocket interface."""
