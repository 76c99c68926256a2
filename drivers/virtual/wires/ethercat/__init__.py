"""A virtual EtherCAT segment: slave controllers that answer real frames.

`segment.Segment` is the pure core (frame in, frame out); `server` puts it on one end of a veth
pair; `launch` starts it as a process of its own and talks to its control channel.
"""
