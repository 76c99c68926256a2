work_axis-already-moved = 轴已由 { QUOTED($other_title) } 驱动
    .remedy = 请等待其结束，或将其停止
work_of-drive = { $title }：{ $drive }
work_run-already = 已有 { $bound } 个{ $what }在运行
    .remedy = 请等待其中之一结束，或取消一个
