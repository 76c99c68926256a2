motion_account-has-another-role = 启动者的账户角色已更改
    .remedy = 请向管理员申请运动权限
motion_beyond-limit = { $quantity ->
    [position] 位置
    [speed] 速度
    [torque] 转矩
    [skew] 歪斜
   *[following-error] 跟随误差
 } { $value } 超出限值 { $limit }：轴已制动并断使能
motion_beyond-limit-in = { $quantity ->
    [position] 位置
    [speed] 速度
    [torque] 转矩
    [skew] 歪斜
   *[following-error] 跟随误差
 } { $value } { $unit } 超出限值 { $limit } { $unit }：轴已制动并断使能
motion_by-door = { $how }（{ $route }）
motion_commanded = 已停止
motion_contradiction = 606Ch 为 { NUM($speed, format: ".6g") }，位置推得 { NUM($from_position, format: ".6g") }（606Ch 的原始单位；{ $note }）：轴已制动并断使能
motion_door-assign = 请在轴断使能时在“输入输出”页面选择端子功能
motion_door-force = 请在“输入输出”页面强制端子
motion_door-move = 请在“运动”页面移动轴，该页面设有限值和失效保护超时
motion_door-power = 请在“运动”页面使能轴并选择其模式
motion_door-procedure = 执行操作流程“{ $title }”
motion_door-set = 由具有运动权限的人员在轴断使能时设置
motion_expired = 设定值未及时更新：轴已制动并断使能
motion_following = 跟随误差超出限值
motion_halted = { $where }：{ $cause }
motion_left-enabled = 驱动器退出了“运行使能（Operation enabled）”：{ $by ->
        [fault] 驱动器有故障
        [quick_stop] 并非由本程序发出的快速停止（端子、另一主站或驱动器自身）
        [voltage] 主电源已断开，或 STO 断开
        [others] 另一主站、端子或驱动器面板使其断使能
       *[other] { "" }
    }{ $by ->
        [fault] （{ $note }）
        [quick_stop] （{ $note }）
        [voltage] （{ $note }）
        [others] （{ $note }）
       *[other] { $note }
    }
motion_lost = 不再收到周期数据
motion_measured-contradict = 测得的位置与速度相互矛盾
motion_move-axis-permission-hand = { $drive }：{ $parameter } 可使轴运动，而现有许可不适用
    .remedy = 请在“运动”页面重新开始运动
motion_moved-already = { $drive } 已在运动：{ $purpose }
    .remedy = 请等待其结束，或将其停止
motion_nobody-asked-motion-not = { $drive }：无人请求此运动，因此不启动
    .remedy = 请在“运动”页面启动
motion_partner = 同一机械的另一轴已停止：{ $note }
motion_permission-move-ended = { $drive }：{ $purpose }：运动许可已结束：{ $why }
    .remedy = 请在安全时重新开始运动
motion_position = 位置超出限值
motion_put-energy-motor-not = { $drive }：{ $parameter } { $key } 可使电机得电，因此不作为参数写入
motion_session-is-over = 启动者的会话已结束
    .remedy = 请登录，然后重新启动
motion_skew = 两轴的歪斜超出限值
motion_speed = 速度超出限值
motion_stop-was-pressed = 已按下“停止”（STOP）
    .remedy = 请查明按下“停止”（STOP）的原因，确认安全后重新启动
motion_time-is-over = 运动已达最长时间
    .remedy = 重新启动；可能需要减少重复次数或缩短范围
motion_torque = 转矩超出限值
motion_unfit = 设定值超出其对象的范围：轴已制动
motion_class-fixed = { $profile_title }：{ $key } { $name }：{ $why }
motion_class-from-manual = 它随 servodeck 提供，其运动类别取自手册
motion_class-in-profile = 其运动类别已在配置中给出
motion_class-needs-reason = { $key }：需要给出属于此运动类别的理由
motion_class-not-writable = 它不可写，因此没有运动类别
motion_class-of-no-parameter = { $profile_title } 没有参数 { $key }
motion_class-of-standard = 其运动类别由标准规定（CiA 301、CiA 402）
motion_purpose-brake-test = 抱闸测试
motion_purpose-command-line = 命令行发起的测量
motion_purpose-exchange = 通过周期通信运动
motion_purpose-first-power = 首次通电
motion_purpose-left-enabled = 保持使能
motion_purpose-profile-velocity = 轮廓速度（Profile velocity）模式下的测量
motion_purpose-restore = 恢复运动中更改的值
motion_purpose-set = 设置 { $key } { $name }
motion_purpose-set-why = 设置 { $key } { $name }：{ $reason }
motion_purpose-state = 切换到“{ $state }”
