"""The live websocket of all pages."""
