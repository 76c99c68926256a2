
limit_above-zero = 大于 0
limit_at-least = 至少 { NUM($value, format: ".10g") } { $unit }
limit_at-least-number = 至少 { NUM($value, format: ".10g") }
limit_below = 低于 { NUM($value, format: ".10g") } { $unit }
limit_between = { NUM($low, format: ".10g") } 至 { NUM($high, format: ".10g") } { $unit }
limit_between-numbers = { NUM($low, format: ".10g") } 至 { NUM($high, format: ".10g") }
limit_bytes = { NUM($count, format: ".10g") } 字节
limit_bytes-as = 例如 { $example }
limit_certain-scale = 确定的标度
limit_characters = { NUM($count, format: ".10g") } 个字符
limit_columns = { $count } 列
limit_days = { $count } 天
limit_each-way = 每个方向 { $distance }
limit_ethercat-port = { $port ->
    [none] 非办公网口
   *[other] { $port }
}
limit_file-name = 字母、数字、空格、. - _，最多 100 个
limit_fixed-process-data = 固定的过程数据：{ $own }
limit_from-start = 距起点 { $distance }
limit_header = 请求头 { $header }
limit_host-name = 1 到 63 个字符：a 到 z、0 到 9 和 -，- 不能在首尾
limit_imported-objects = 导入的配置文件中任何标准均未描述的对象
limit_interface-name = 1 至 15 个字母、数字及 . _ - @ :，如 eth0
limit_jitter = 与 { NUM($usual_ms, format: ".6g") } ms 相差不超过 { NUM($percent, format: ".0f") }%
limit_length = { $least } 至 { $most } 个字符
limit_lines = { $count } 行
limit_look-only = 仅查看
limit_none = 无
limit_notch-there = 该频率处的陷波器
limit_objects = { $count } 个对象
limit_one-of-columns = 列 { $numbers } 之一
limit_per-cycle = 每周期 { $longest }
limit_place-of-contents = 文件夹，或安装 servodeck[s3] 后的 s3://
limit_printable = { $least } 至 { $most } 个可打印字符
limit_profile-name = 小写字母、数字和 _，以字母开头
limit_serial-device = 串行设备的路径，如 /dev/ttyUSB0，或 COM1 至 COM999
limit_stays-free = 保留 { $mebibytes } MiB 空闲
limit_tags = { $tags } 个标签，每个 { $count } 个字符
limit_up-to-over = 不超过 { NUM($above, format: ".10g") } / { NUM($below, format: ".10g") }
limit_version-7 = 版本 7
limit_within-time = { NUM($timeout_s, format: "g") } s 内达到 { $wanted }
limit_from-to = { $low } 至 { $high }
limit_no-limit = 无限制
limit_number-too-large = 超出可表示范围的数值
limit_raw = { $value }（原始值 { $raw }）
limit_choice = { $number }（{ $meaning }）
