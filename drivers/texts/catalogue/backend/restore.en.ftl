restore_cannot-removed = { $file } cannot be removed: { $strerror }
