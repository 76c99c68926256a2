scope_already = 已存储 { $most } 个，达到上限
    .remedy = 请删除不需要的
scope_no = 没有 { $value }
    .remedy = 请从列表中选择
scope_no-snapshot-scope = { $value } 不是示波器快照：{ $why }
    .remedy = 请选择“示波器”页面写出的文件
scope_not-stored-disk-nearly = { $path } 未保存：磁盘将满，剩余 { $free_mib } MiB
    .remedy = 请释放存储空间
