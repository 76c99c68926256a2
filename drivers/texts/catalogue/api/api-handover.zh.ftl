api-handover_drive = { $value } 属于 { $profile } 驱动器，而 { $drive } 是 { $profile_drive }
    .remedy = 请选择同系列驱动器的参数集
api-handover_esi-file-not-base64 = ESI 文件不是 base64 编码
    .remedy = 请重新发送
api-handover_larger-bytes = { $file } 大于 { $max_bytes } 字节
    .remedy = 请选择其他文件
api-handover_no-hand-over = { $drive_name } 没有交接记录 { $value }
    .remedy = 请从列表中选择
