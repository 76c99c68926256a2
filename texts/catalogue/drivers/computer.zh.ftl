computer_ethercat-not-available-servodeck = { $value } 上不能使用 EtherCAT：servodeck 仅在 Linux 上运行 EtherCAT
    .remedy = 请在机器旁的 Linux 计算机上运行 servodeck，并从此处打开其页面；本机可使用 Modbus、MLink 和 slcan 的 CANopen
computer_shared-memory-not-available = 不能为 { $value } 使用共享内存：servodeck 仅在 Linux 上运行 EtherCAT
    .remedy = 请在机器旁的 Linux 计算机上运行 servodeck
