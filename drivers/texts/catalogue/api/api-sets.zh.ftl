api-sets_give-either-file-against = file 与 against 只能给出其一
    .remedy = 请选择一个比较对象
api-sets_larger-bytes = { $file } 大于 { $max_bytes } 字节
    .remedy = 请选择其他文件
api-sets_base-other-family = 基准属于另一驱动器系列
api-sets_other-family = 该文件属于另一驱动器系列：其中任何值都不能写入此驱动器
