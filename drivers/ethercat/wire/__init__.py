"""EtherCAT protocols: registers, mailbox, CoE, FoE, SII, without I/O of their own."""
