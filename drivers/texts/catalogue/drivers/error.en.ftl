error_defect = this is a defect of servodeck; report it with the log
error_internal = internal error: { $kind }: { $detail }
error_link-lost = check the cable and the adapter or interface; the link is opened again automatically
error_link-timeout = check supply and cable, then try again; read back what was being written
error_protocol-error = try again; if it persists, check shield, termination and line settings
error_within-limit = choose a value within the limit
