step_no-size = size（阶跃大小）不能为 0
step_step-needs-rev-more = 该阶跃需要 { NUM($highest, format: ".4g") } { $name } 和 { NUM($travelled_rev, format: ".3g") } rev，超过限值 { NUM($speed_rpm, format: "g") } rpm 和 { NUM($travel_rev, format: "g") } rev
    .remedy = 请减小阶跃或放宽限值
step_stepping = 阶跃中
step_title = 阶跃响应
