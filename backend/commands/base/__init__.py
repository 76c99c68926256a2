"""What the commands share: options, output, a drive on a bus, requests to a server."""
