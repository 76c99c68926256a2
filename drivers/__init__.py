"""Communication with a drive: links, wire formats, and virtual drives on real wires."""
