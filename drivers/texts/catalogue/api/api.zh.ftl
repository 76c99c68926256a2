api_no = 没有 { $path }
api_no-time-utc = { $moment } 不是 UTC 时间
    .remedy = 请选择更晚或更早的日期
api_nobody-logged = 无人登录
    .remedy = 请登录
api_nothing = /{ $path } 处没有内容
    .remedy = 请参见 /api/v1/openapi.json
api_see-interface = 此地址接受的内容请参见 /api/v1/openapi.json
