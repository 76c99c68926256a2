mlink_mlink-cannot-tell-both = MLink 无法区分 { $address } 与 { $rival }：两者的寄存器相同
    .remedy = 此对象请使用 EtherCAT
mlink_mlink-moves-most-32 = { $address } 是 { $type }：MLink 最多传送 32 位
    .remedy = 此对象请使用 EtherCAT
mlink_no-object-mlink-reaches = { $address } 不是对象：MLink 只能访问对象
    .remedy = 请用索引和子索引指定对象
mlink_no-register-number-mlink = { NUM($index, format: "04X") }:{ NUM($subindex, format: "02X") } 在 MLink 上没有寄存器号
    .remedy = 此对象请使用 EtherCAT
