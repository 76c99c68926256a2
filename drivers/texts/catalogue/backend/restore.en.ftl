restore_cannot-removed = { $file } cannot be removed: { $strerror }
restore_free-the-disk = free space on the disk of the state folder, or check who may write there, and start again
restore_list-damaged = { $drive }: the list of values that a motion had changed is damaged, so they are not known and not restored: { $file }. Compare the drive's parameters with a stored set before the axis moves, then delete the file
restore_not-kept = { $drive }: nothing was changed and nothing moves: what a motion changes temporarily cannot be noted on the disk, so nobody could restore it after a power failure: { $cause }
