error_defect = 这是 servodeck 的缺陷；请附上日志报告
error_internal = 内部错误：{ $kind }：{ $detail }
error_link-lost = 请检查电缆和适配器或接口；链路会自动恢复
error_link-timeout = 请检查供电和电缆后重试；对正在写入的值请回读确认
error_protocol-error = 请重试；若仍出现，请检查屏蔽、终端电阻和线路设置
error_within-limit = 请选择限值以内的数值
