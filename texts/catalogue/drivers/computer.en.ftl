computer_ethercat-not-available-servodeck = EtherCAT on { $value } is not available: servodeck runs EtherCAT on Linux only
    .remedy = run servodeck on a computer with Linux at the machine and open its page from here; Modbus, MLink and CANopen by slcan work on this one
computer_shared-memory-not-available = shared memory for { $value } is not available: servodeck runs EtherCAT on Linux only
    .remedy = run servodeck on a computer with Linux at the machine
