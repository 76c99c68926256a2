"""CANopen files: EDS, and DCF with the values of one device (CiA 306-1)."""
