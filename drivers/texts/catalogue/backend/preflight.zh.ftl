preflight_adapter-in-use = { $device } 正被程序使用，而更改会重启适配器
    .remedy = 请关闭 { $device } 上的总线或其他程序，然后重试
preflight_as-administrator = 以计算机管理员身份执行：{ $command }
preflight_cannot-restored = 无法将 { $setting } 恢复为 { $value }：{ $strerror }
    .remedy = 重新启动计算机即可恢复
preflight_cannot-set = 无法将 { $setting } 设为 { $value }：{ $strerror }
preflight_ethercat-master-servodeck-uses = servodeck 的一个 EtherCAT 主站正在使用 { $interface }
    .remedy = 请先关闭该总线，或不带接口运行预检
preflight_latency-as-administrator = 请以 Windows 管理员身份启动一次 servodeck，或手动设置：设备管理器、端口、{ $device }、端口设置、高级、延迟计时器（Latency Timer）：{ $ms }
preflight_latency-as-root = 以计算机管理员身份执行：echo { $ms } | sudo tee /{ $place }
preflight_latency-denied = 无法将 { $device } 的延迟计时器设为 { $value }：只有计算机管理员可以设置
preflight_latency-failed = 无法将 { $device } 的延迟计时器设为 { $value }：{ $strerror }
    .remedy = 请重新插上适配器，然后重试
preflight_latency-list-unreadable = 无法读取已更改的延迟计时器列表：{ $path }
    .remedy = 请删除该文件；计时器随后保持现状
preflight_latency-not-changed = servodeck 没有更改过 { $device } 的延迟计时器
preflight_latency-range = { $value } 不是延迟计时器的值
    .remedy = 请选择 { $limit } ms
preflight_list-preflight-changed-cannot = 无法读取预检所作更改的列表：{ $path }
    .remedy = 重新启动计算机以恢复这些设置，然后删除该文件
preflight_measurement-failed = { $interface ->
    [none] 在本计算机上
   *[other] 在 { $interface } 上
 }的测量失败：{ $reason }
    .remedy = 请不带接口运行预检，并先看它列出的第一项
preflight_no-latency-timer = 不知道适配器 { $device } 的延迟计时器
    .remedy = 只有 FTDI 芯片有：请检查端口名称
