"""A station in the cabinet (edge box): its name, and what each of its network ports is for.

`kept` reads and writes them, `roles` checks them and keeps EtherCAT off the office's port, `shown`
puts the address on the console, `announced` makes the name known in the office's network (mDNS).
"""
