"""CAN adapters: opening one, sending, receiving, and reopening it after a loss."""
