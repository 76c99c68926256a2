api-drive_back-forth = 往复运动：{ $member_drive }
api-drive_cancelled-during = { $drive }：在“{ $title }”期间被取消：{ $why }
    .remedy = 请在安全时重试
api-drive_choose-one = 请选择其中之一：{ $names }
api-drive_commands-motion-axis-enabled = { $drive }：{ $parameter } 用于指令运动，而轴已使能
    .remedy = 请使用“运动”页面，其中设有限值和失效保护超时；或断使能
api-drive_cyclic-exchange-not-run = { $drive }：周期通信未运行
    .remedy = 请在“连接”页面启动
api-drive_detail = { $mode } 模式下的{ $shape ->
    [step] 阶跃
    [ramp] 斜坡
    [trapezoid] 梯形
    [sine] 正弦
   *[chirp] 扫频信号
 }：{ $member_drive }
api-drive_fault-reset = 故障复位
api-drive_give-either-raw-value = { $drive }：{ $parameter }：只能给出 raw 或 value 之一
    .remedy = 请只发送两者之一
api-drive_has-none = 本驱动器没有此项：请用其他方法
api-drive_home-method = { $member_drive } 回零（方式 { $method }）
api-drive_identification-drive = 由驱动器辨识：{ $member_drive }
api-drive_load = 将 { $file } 载入 { $member_drive }
api-drive_move = 移动 { $member_drive }（{ $mode }）
api-drive_no-homing-method = { $drive } 没有回零方式 { $value }
api-drive_no-mode = { $drive } 没有模式 { $value }
    .remedy = 请选择它支持的模式
api-drive_no-number = { $drive }：{ $parameter }：{ NUM($given, format: "g") } 不是数字
    .remedy = 请给出有限的数字
api-drive_no-parameter = { $drive } 没有参数 { $key }
api-drive_no-parameter-search-parameters = { $drive } 没有参数 { $parameter }
    .remedy = 请在“参数”页面按名称或编号查找；参数键形如 6040:00
api-drive_no-parameter-see-list = { $known_title } 没有参数 { $parameter }
    .remedy = 请查看参数列表
api-drive_no-procedure = { $drive } 没有操作流程 { QUOTED($value) }
api-drive_no-terminals-overruled-like = { $drive }：当前没有以此方式强制的端子
    .remedy = 请重新开始强制；页面停止响应时强制即结束
api-drive_nothing-put-back = { $drive }：没有需要恢复的内容
    .remedy = 请查看其参数；可能已经恢复
api-drive_read = 读取 { $member_drive }
api-drive_small-move = 小幅运动 { $increments } 个增量：{ $drive }
api-drive_use-page-of-function = 请使用该对象所属功能的页面
