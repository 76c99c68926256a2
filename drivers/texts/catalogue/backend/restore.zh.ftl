restore_cannot-removed = 无法删除 { $file }：{ $strerror }
restore_free-the-disk = 请释放状态文件夹所在磁盘的空间，或检查其写权限，然后重新开始
restore_list-damaged = { $drive }：被中断运动的恢复清单已损坏，其中的值未知，也未恢复：{ $file }。在轴运动之前，请将驱动器参数与已保存的参数集比较，然后删除该文件
restore_not-kept = { $drive }：运动未开始，也未更改任何值，因为无法将恢复清单写入磁盘：{ $cause }。没有该清单，断电后无法恢复设置
