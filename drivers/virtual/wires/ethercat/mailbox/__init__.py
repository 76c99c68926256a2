"""The mailbox of a slave and its protocols: CoE with its dictionary, FoE."""
