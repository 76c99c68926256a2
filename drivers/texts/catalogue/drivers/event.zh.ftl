event_another-master = 另一个主站正在与节点 { $node } 通信：应答可能混淆。写入任何值之前，请先停止另一个主站
event_answers-too-late = { $interface } 上的应答来得太晚，无法与请求对应：将重新打开该适配器
event_can-adapter-back = CAN 适配器 { $channel } 已恢复
event_exchange-broke-off = 周期通信中断：{ $cause }。所有轴停止，周期通信将自动重新建立
event_exchange-ended-by-itself = 周期通信自行结束
event_exchange-interrupted = 周期通信中断：{ $cause }
event_exchange-not-restored = 周期通信未能重新建立：{ $cause }；将自动重试
event_exchange-runs-again = 周期通信已恢复运行；所有轴保持断使能，需手动使能
event_guarding-answer-repeated = 节点 { $node } 重复了节点保护应答：有应答丢失，或两个节点使用同一编号
event_heartbeat-stopped = 节点 { $node } 已停止发送心跳 { NUM($silent_s, format: ".1f") } s
event_interface-back = 接口 { $interface } 已恢复
event_interface-gone = 网络接口 { $interface } 已消失
event_lost = { $cause }。{ $remedy }
event_more-emergencies = 节点 { $node } 在 1 s 内又发送了 { $count } 条紧急报文，最后一条为 { NUM($number, format: "04X") }h。可能是某个触点或限位反复通断
event_no-guarding-answer = 节点 { $node } 不应答节点保护
event_no-heartbeat-watchdog = 节点 { $node } 没有心跳监视（1016h）：本计算机停止发送时它无法察觉
event_node-answers-again = 节点 { $node } 恢复应答
event_node-emergency = 节点 { $node }：{ $meaning }（紧急报文 { NUM($number, format: "04X") }h，错误寄存器 { NUM($register, format: "02X") }h）
event_node-emergency-bytes = 节点 { $node }：{ $meaning }（紧急报文 { NUM($number, format: "04X") }h，错误寄存器 { NUM($register, format: "02X") }h，厂家字节 { $bytes }）
event_node-restarted = 节点 { $node } 已重新启动：未保存的值已丢失，请重新读取
event_node-started = 节点 { $node } 已启动
event_node-state = 节点 { $node } 的状态为 { $state ->
        [stopped] 停止（stopped）
        [operational] 运行（operational）
        [pre-operational] 预运行（pre-operational）
       *[other] { $state }
    }
event_of-node = 节点 { $node }：{ $event }
event_own-number-started = 节点 { $node } 已启动，其编号与本计算机的心跳编号相同
event_pdos-not-restored = PDO 未能恢复：{ $cause }
event_process-died = EtherCAT 进程意外结束（状态 { $status }）
event_process-hung = EtherCAT 进程在{ $doing }时停止响应，已被终止
event_process-runs-again = EtherCAT 进程已恢复运行
event_process-started-again = { $cause }；正在重新启动
event_serial-port-back = 串口 { $device } 已恢复
event_station-answers-again = 站 { $station } 恢复应答
event_station-emergency = 站 { $station }：紧急报文 { NUM($number, format: "#06x") }，错误寄存器 { NUM($register, format: "#04x") }，数据 { $bytes }
event_station-error = 站 { $station } 处于 { $state }：{ $cause }
event_station-error-gone = 站 { $station }：错误已消除
event_station-lost = 站 { $station }（{ $name }）不再应答：供电断开或电缆中断
event_station-operational = 站 { $station } 重新进入 OP
event_station-operational-disabled = 站 { $station } 重新进入 OP，保持断使能
event_station-state = 站 { $station } 处于 { $state }
event_station-switched-on = 站 { $station } 已重新上电
event_two-nodes-answer = 有两个节点以编号 { $node } 应答：二者都会执行写入。请关闭其中一个，并为其设置其他编号
