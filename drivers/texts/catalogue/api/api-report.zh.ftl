api-report_not-measured = { $value } 不是在 { $drive } 上测量的
    .remedy = 请选择此驱动器的测量
