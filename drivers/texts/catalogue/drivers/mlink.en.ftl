mlink_mlink-cannot-tell-both = MLink cannot distinguish { $address } from { $rival }: both have the same register
    .remedy = use EtherCAT for this object
mlink_mlink-moves-most-32 = { $address } is a { $type }: MLink moves at most 32 bits
    .remedy = use EtherCAT for this object
mlink_no-object-mlink-reaches = { $address } is not an object: MLink reaches objects only
    .remedy = name the object by index and subindex
mlink_no-register-number-mlink = { NUM($index, format: "04X") }:{ NUM($subindex, format: "02X") } has no register number on MLink
    .remedy = use EtherCAT for this object
