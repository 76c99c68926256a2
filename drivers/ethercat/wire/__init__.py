"""EtherCAT bytes: registers, mailbox, CoE, FoE, SII, without I/O of their own."""
