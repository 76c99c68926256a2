"""Texts of the preflight in English and Chinese, made from codes and figures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, NamedTuple

from backend.foundation.preflight.findings import Code, Finding, Fix
from backend.foundation.preflight.verdicts import Grade, Purpose, Verdict

Language = Literal["en", "zh"]


class Words(NamedTuple):
    """Description of a finding, and its remedy."""

    what: str
    remedy: str


def words(one: Finding, language: Language = "en") -> Words:
    """A finding as text."""
    what, remedy = _FINDINGS[language][one.code]
    shown = {name: _shown(value) for name, value in one.params.items()}
    if "share" in one.params:
        shown["share"] = f"{float(one.params['share']):.0%}"
    return Words(what.format_map(shown), remedy.format_map(shown))


def purpose_name(purpose: Purpose, language: Language = "en") -> str:
    """Name of a purpose."""
    return _PURPOSES[language][purpose]


def fix_name(fix: Fix, language: Language = "en") -> str:
    """Name of a fix."""
    return _FIXES[language][fix]


def verdict_words(one: Verdict, language: Language = "en") -> str:
    """A verdict with its figures, as text."""
    grade = _GRADES[language][one.grade]
    texts = _REASONS[language]
    if one.blocked_by is not None:
        return texts["blocked"].format(grade=grade)
    if one.missed_bound is None or one.allowed is None:
        return grade
    line = texts["missed"].format(
        grade=grade, bound=_percent(one.missed_bound), allowed=_percent(one.allowed)
    )
    return line if one.frames_included else line + texts["no_frames"]


def _shown(value: str | float) -> str:
    return value if isinstance(value, str) else f"{value:g}"


def _percent(share: float) -> str:
    return f"{100 * share:.2g} %"


_FINDINGS: Mapping[Language, Mapping[Code, Words]] = {
    "en": {
        Code.NO_INTERFACE: Words(
            "There is no network interface {interface}.",
            "Choose one of the interfaces that the page Connect lists.",
        ),
        Code.MISSING_CAPABILITY: Words(
            "The permission for raw frames is missing: {capabilities}.",
            "Run servodeck by the unit that `servodeck station unit` prints,"
            " or grant them by setcap.",
        ),
        Code.WIRELESS: Words(
            "{interface} is a wireless interface, which does not carry EtherCAT.",
            "Use a network port with a cable.",
        ),
        Code.INTERFACE_DOWN: Words(
            "{interface} is switched off.", "sudo ip link set {interface} up"
        ),
        Code.NO_CARRIER: Words(
            "{interface} has no link.", "Check the cable, and the supply of the first drive."
        ),
        Code.DHCP_ON_PORT: Words(
            "{by} asks for an address (DHCP) on {interface}, and takes the port down"
            " when it gets none.",
            "Switch DHCP off for this port; with NetworkManager:"
            " nmcli device set {interface} managed no",
        ),
        Code.PORT_MANAGED: Words(
            "{by} manages {interface} and may take it down at any time.",
            "nmcli device set {interface} managed no",
        ),
        Code.PORT_CARRIES_IP: Words(
            "{interface} carries other traffic (IP): is it the office's port?",
            "Use a port of its own for EtherCAT, without an address.",
        ),
        Code.ON_BATTERY: Words(
            "The computer runs on its battery: it saves power and may go to sleep.",
            "Plug the supply in.",
        ),
        Code.BUSY_CORE: Words(
            "A core is busy to {share} with other programs, and this process may not go"
            " before them.",
            "End the other programs, or allow real-time scheduling (CAP_SYS_NICE).",
        ),
        Code.NO_REAL_TIME: Words(
            "Real-time scheduling (SCHED_FIFO) is not permitted.",
            "Grant CAP_SYS_NICE, as the unit of `servodeck station unit` does, or an rtprio limit.",
        ),
        Code.STOLEN_TIME: Words(
            "This is a virtual machine, and its host takes {share} of the processor's time.",
            "Run servodeck on a computer itself, or give the machine cores of its own.",
        ),
        Code.MEMORY_NOT_LOCKED: Words(
            "Memory may not be locked: a page that was written out delays a cycle.",
            "Grant CAP_IPC_LOCK, or a memlock limit of unlimited.",
        ),
        Code.DEEP_IDLE: Words(
            "The processor sleeps deeply: leaving {state} takes {latency_us} µs.",
            "Switch the deep C-states off.",
        ),
        Code.GOVERNOR: Words(
            "The processor's clock is lowered when there is little to do (governor {governor}).",
            "Set the governor performance.",
        ),
        Code.COALESCING: Words(
            "The card of {interface} holds interrupts back for {delay_us} µs (coalescing).",
            "Set rx-usecs and tx-usecs to 0.",
        ),
        Code.IRQ_ON_BUSY_CORE: Words(
            "Interrupt {irq} of {interface} is handled by core {core}, which is busy.",
            "Have another core handle it.",
        ),
        Code.IRQ_BALANCED: Words(
            "irqbalance moves the interrupts of {interface} from core to core.",
            "Have one core handle them, and stop irqbalance.",
        ),
        Code.GROUPED_FRAMES: Words(
            "The card of {interface} groups frames before it delivers them ({which}).",
            "Switch the grouping off.",
        ),
        Code.KERNEL: Words(
            "The kernel {kernel} cannot be interrupted within system calls.",
            "Install a kernel with PREEMPT_DYNAMIC or PREEMPT_RT.",
        ),
    },
    "zh": {
        Code.NO_INTERFACE: Words("没有网络接口 {interface}。", "请选择“连接”页面列出的接口。"),
        Code.MISSING_CAPABILITY: Words(
            "缺少收发原始帧的权限：{capabilities}。",
            "请用 `servodeck station unit` 输出的单元运行 servodeck，或用 setcap 授予权限。",
        ),
        Code.WIRELESS: Words("{interface} 是无线接口，不能传输 EtherCAT。", "请使用有线网口。"),
        Code.INTERFACE_DOWN: Words("{interface} 已关闭。", "sudo ip link set {interface} up"),
        Code.NO_CARRIER: Words("{interface} 没有链路。", "请检查网线和第一台驱动器的供电。"),
        Code.DHCP_ON_PORT: Words(
            "{by} 在 {interface} 上请求地址（DHCP），得不到地址时会关闭该网口。",
            "请关闭该网口的 DHCP；使用 NetworkManager 时：nmcli device set {interface} managed no",
        ),
        Code.PORT_MANAGED: Words(
            "{by} 管理 {interface}，随时可能关闭它。", "nmcli device set {interface} managed no"
        ),
        Code.PORT_CARRIES_IP: Words(
            "{interface} 上有其他通信（IP）：这是办公网口吗？",
            "请为 EtherCAT 使用单独的、没有地址的网口。",
        ),
        Code.ON_BATTERY: Words("计算机由电池供电：会节能，并可能休眠。", "请接上电源。"),
        Code.BUSY_CORE: Words(
            "一个处理器核心有 {share} 被其他程序占用，而本进程不能优先运行。",
            "请结束其他程序，或允许实时调度（CAP_SYS_NICE）。",
        ),
        Code.NO_REAL_TIME: Words(
            "不允许实时调度（SCHED_FIFO）。",
            "请像 `servodeck station unit` 的单元那样授予 CAP_SYS_NICE，或设置 rtprio 限值。",
        ),
        Code.STOLEN_TIME: Words(
            "这是虚拟机，宿主机占去处理器时间的 {share}。",
            "请在实体计算机上运行 servodeck，或给虚拟机独占的核心。",
        ),
        Code.MEMORY_NOT_LOCKED: Words(
            "不允许锁定内存：被换出的内存页会使周期延迟。",
            "请授予 CAP_IPC_LOCK，或将 memlock 限值设为 unlimited。",
        ),
        Code.DEEP_IDLE: Words(
            "处理器进入深度休眠：退出 {state} 需要 {latency_us} µs。", "请关闭深度 C 状态。"
        ),
        Code.GOVERNOR: Words(
            "空闲时处理器降频（调速器 {governor}）。", "请将调速器设为 performance。"
        ),
        Code.COALESCING: Words(
            "{interface} 的网卡将中断推迟 {delay_us} µs（中断合并）。",
            "请将 rx-usecs 和 tx-usecs 设为 0。",
        ),
        Code.IRQ_ON_BUSY_CORE: Words(
            "{interface} 的中断 {irq} 由繁忙的核心 {core} 处理。", "请改由其他核心处理。"
        ),
        Code.IRQ_BALANCED: Words(
            "irqbalance 在各核心之间移动 {interface} 的中断。",
            "请固定由一个核心处理，并停止 irqbalance。",
        ),
        Code.GROUPED_FRAMES: Words("{interface} 的网卡在交付前合并帧（{which}）。", "请关闭合并。"),
        Code.KERNEL: Words(
            "内核 {kernel} 在系统调用中不能被抢占。",
            "请安装带 PREEMPT_DYNAMIC 或 PREEMPT_RT 的内核。",
        ),
    },
}
_PURPOSES: Mapping[Language, Mapping[Purpose, str]] = {
    "en": {
        Purpose.PARAMETERS: "Parameters, alarms, faults",
        Purpose.SCOPE_1_KHZ: "Scope at 1 kHz",
        Purpose.RESPONSE_1_KHZ: "Frequency response at 1 kHz",
        Purpose.RESPONSE_4_KHZ: "Frequency response at 4 kHz",
    },
    "zh": {
        Purpose.PARAMETERS: "参数、报警、故障",
        Purpose.SCOPE_1_KHZ: "1 kHz 示波器",
        Purpose.RESPONSE_1_KHZ: "1 kHz 频率响应",
        Purpose.RESPONSE_4_KHZ: "4 kHz 频率响应",
    },
}
_GRADES: Mapping[Language, Mapping[Grade, str]] = {
    "en": {
        Grade.SUITABLE: "suitable",
        Grade.LIMITED: "of limited use",
        Grade.UNSUITABLE: "not suitable",
        Grade.NOT_MEASURED: "not measured",
    },
    "zh": {
        Grade.SUITABLE: "适合",
        Grade.LIMITED: "有限适用",
        Grade.UNSUITABLE: "不适合",
        Grade.NOT_MEASURED: "未测量",
    },
}
_REASONS: Mapping[Language, Mapping[str, str]] = {
    "en": {
        "blocked": "{grade}: no frame gets through",
        "missed": "{grade}: at most {bound} of the cycles are missed (95 % confidence);"
        " up to {allowed} is suitable",
        "no_frames": "; wake-ups alone, without frames",
    },
    "zh": {
        "blocked": "{grade}：帧无法通过",
        "missed": "{grade}：错过的周期不超过 {bound}（置信度 95 %）；不超过 {allowed} 为适合",
        "no_frames": "；仅唤醒，不含帧",
    },
}
_FIXES: Mapping[Language, Mapping[Fix, str]] = {
    "en": {
        Fix.GOVERNOR: "Set the governor performance",
        Fix.IDLE: "Switch deep C-states off",
        Fix.COALESCING: "Switch coalescing off",
        Fix.GROUPED_FRAMES: "Switch grouping of frames off",
        Fix.INTERRUPTS: "Have the least busy core handle the interrupts",
    },
    "zh": {
        Fix.GOVERNOR: "将调速器设为 performance",
        Fix.IDLE: "关闭深度 C 状态",
        Fix.COALESCING: "关闭中断合并",
        Fix.GROUPED_FRAMES: "关闭帧合并",
        Fix.INTERRUPTS: "由最空闲的核心处理中断",
    },
}
