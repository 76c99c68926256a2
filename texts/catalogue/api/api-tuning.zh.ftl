api-tuning_give-either-gains-level = 增益与等级只能给出其一
    .remedy = 请给出其中之一
api-tuning_not-frequency-response = { $value } 不是频率响应
api-tuning_now-change-left-changed = { $drive }：{ $parameter } 现为 { $value }，而此更改写入的是 { $left }：之后又被修改过，因此未撤销
    .remedy = 请查看更改列表；仍然撤销，或写入所需的值
api-tuning_too-large = { $name } 过大
    .remedy = 请按本程序导出的形式逐个导入测量
