"""Serial ports: terminals, and the latency timer of USB adapters."""
