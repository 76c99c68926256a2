restore_cannot-removed = { $file } cannot be removed: { $strerror }
restore_free-the-disk = free space on the disk of the state folder, or check who may write there, and start again
restore_list-damaged = { $drive }: the restore list of an interrupted motion is damaged, so its values are not known and not restored: { $file }. Compare the drive's parameters with a stored set before the axis moves, then delete the file
restore_not-kept = { $drive }: the motion was not started and nothing was changed, because the restore list cannot be written to the disk: { $cause }. Without it, settings could not be restored after a power failure
