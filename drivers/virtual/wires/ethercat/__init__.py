"""A virtual EtherCAT segment: slave controllers that process real frames.

`segment.Segment` is the pure core (frame in, frame out); `server` connects it to one end of a veth
pair; `launch` starts it as a separate process and uses its control channel.
"""
