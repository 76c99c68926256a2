restore_cannot-removed = 无法删除 { $file }：{ $strerror }
