"""EtherCAT: pysoem in a process of its own, and the Link that communicates with it."""
