"""Network interfaces: sockets, frames, offloads and namespaces."""
