preflight_as-administrator = 以计算机管理员身份执行：{ $command }
preflight_cannot-restored = 无法将 { $setting } 恢复为 { $value }：{ $strerror }
    .remedy = 重新启动计算机即可恢复
preflight_cannot-set = 无法将 { $setting } 设为 { $value }：{ $strerror }
preflight_ethercat-master-servodeck-uses = servodeck 的一个 EtherCAT 主站正在使用 { $interface }
    .remedy = 请先关闭该总线，或不带接口运行预检
preflight_list-preflight-changed-cannot = 无法读取预检所作更改的列表：{ $path }
    .remedy = 重新启动计算机以恢复这些设置，然后删除该文件
preflight_measurement-failed = { $interface ->
    [none] 在本计算机上
   *[other] 在 { $interface } 上
 }的测量失败：{ $reason }
    .remedy = 请不带接口运行预检，并先看它列出的第一项
