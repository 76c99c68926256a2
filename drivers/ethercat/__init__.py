"""EtherCAT: pysoem in a process of its own, and the Link that talks to it."""
