api-library_lies-station = { $value } 位于站点 { $station }
    .remedy = 请在该站点删除
api-library_no-finished-file-station = { $value } 不是本站点已完成的文件
    .remedy = 请在其结束后于所属站点共享
api-library_no-longer-folder = { $value } 已不在其文件夹中
    .remedy = 它已被删除；请重新搜索
api-library_no-thing-library = 库中没有该项
