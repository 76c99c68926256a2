"""Buses, interfaces, scan, connected drives, jobs, log, STOP, EtherCAT segments, descriptions."""
