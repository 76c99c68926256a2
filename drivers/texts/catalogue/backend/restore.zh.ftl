restore_cannot-removed = 无法删除 { $file }：{ $strerror }
restore_free-the-disk = 请释放状态文件夹所在磁盘的空间，或检查其写权限，然后重新开始
restore_list-damaged = { $drive }：运动所更改数值的列表已损坏，因此这些值未知，也未恢复：{ $file }。轴运动前请将驱动器参数与已保存的参数集比较，然后删除该文件
restore_not-kept = { $drive }：未更改任何值，也不会运动：运动中临时更改的值无法记录到磁盘，断电后将无法恢复：{ $cause }
