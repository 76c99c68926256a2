"""The systemd unit of a station."""

from __future__ import annotations

from drivers.computer.permissions import NEEDED, USEFUL

_UNIT = """\
[Unit]
Description=servodeck, servo-drive commissioning
After=network-online.target
Wants=network-online.target

[Service]
User=servodeck
ExecStart=/opt/servodeck/bin/servodeck serve --bind 0.0.0.0 --port 8420 --config /var/lib/servodeck
Restart=on-failure
RestartSec=2
# The one-time code of the set-up stands on the screen of the computer as well.
StandardOutput=journal+console
# For EtherCAT: raw frames, promiscuous mode, real-time priority, locked memory. Leave both lines
# out where only serial lines are used.
AmbientCapabilities={capabilities}
CapabilityBoundingSet={capabilities}
LimitRTPRIO=80
# Answers, STOP among them, before whatever else this computer does. Linux shares the processor
# between services and sessions first, and only within them by how nice each is.
Nice=-10
CPUWeight=900
LimitMEMLOCK=infinity
# It writes nowhere but in its state folder.
ProtectSystem=strict
ReadWritePaths=/var/lib/servodeck
ProtectHome=true
PrivateTmp=true
NoNewPrivileges=true
ProtectKernelTunables=true
ProtectControlGroups=true
RestrictSUIDSGID=true
UMask=0077
# On shutdown what moves is braked first.
KillSignal=SIGTERM
TimeoutStopSec=15

[Install]
WantedBy=multi-user.target
"""


def systemd_unit() -> str:
    """The text of ``servodeck.service``.

    It grants exactly the capabilities that `permissions.check` requires, and limits the process to
    these (systemd.exec(5)).
    """
    return _UNIT.format(capabilities=" ".join((*NEEDED, *USEFUL)))
