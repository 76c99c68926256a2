"""A station in the cabinet (edge box): its name, and the role of each network port.

`kept` reads and writes them, `roles` checks them and refuses EtherCAT on the office port, `shown`
prints the address on the console, `announced` publishes the name in the office network (mDNS).
"""
