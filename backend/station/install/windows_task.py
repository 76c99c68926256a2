"""The task that starts a station on Windows when the computer starts or its user logs in.

Task Scheduler instead of a service: a service of Windows must answer its manager by calls of its
own, which a program of a terminal does not. Form: learn.microsoft.com, "Task Scheduler Schema".
"""

from __future__ import annotations

from collections.abc import Sequence
from xml.sax.saxutils import escape

_NAMESPACE = "http://schemas.microsoft.com/windows/2004/02/mit/task"
#: The scheduler ends a task after three days and when the battery takes over, unless its file
#: states otherwise: a server with an axis in motion must not be ended. A second start is refused
#: by the lock of the state folder as well.
_TASK = """\
<?xml version="1.0" encoding="UTF-16"?>
<Task version="1.2" xmlns="{namespace}">
  <RegistrationInfo>
    <Description>servodeck, servo-drive commissioning</Description>
  </RegistrationInfo>
  <Triggers>
    <LogonTrigger>
      <Enabled>true</Enabled>
    </LogonTrigger>
  </Triggers>
  <Principals>
    <Principal id="Author">
      <LogonType>InteractiveToken</LogonType>
      <RunLevel>LeastPrivilege</RunLevel>
    </Principal>
  </Principals>
  <Settings>
    <MultipleInstancesPolicy>IgnoreNew</MultipleInstancesPolicy>
    <DisallowStartIfOnBatteries>false</DisallowStartIfOnBatteries>
    <StopIfGoingOnBatteries>false</StopIfGoingOnBatteries>
    <IdleSettings>
      <StopOnIdleEnd>false</StopOnIdleEnd>
    </IdleSettings>
    <ExecutionTimeLimit>PT0S</ExecutionTimeLimit>
    <Priority>4</Priority>
    <RestartOnFailure>
      <Interval>PT1M</Interval>
      <Count>3</Count>
    </RestartOnFailure>
  </Settings>
  <Actions Context="Author">
    <Exec>
      <Command>{program}</Command>
      <Arguments>{arguments}</Arguments>
    </Exec>
  </Actions>
</Task>
"""


def windows_task(program: str, arguments: Sequence[str]) -> str:
    """The task as XML that ``schtasks /Create /XML`` reads, for this program.

    ``program`` may have spaces; arguments with spaces are quoted.
    """
    quoted = " ".join(f'"{one}"' if " " in one or not one else one for one in arguments)
    return _TASK.format(namespace=_NAMESPACE, program=escape(program), arguments=escape(quoted))
