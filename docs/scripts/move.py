"""Move an axis by some revolutions and back, and print where it is. THE AXIS MOVES.

    python move.py DRIVE_ID REVOLUTIONS SPEED_RPM

Ctrl+C presses STOP, which stops every axis of the station. The server is named by
SERVODECK_SERVER, a token by SERVODECK_TOKEN.
"""

import os
import sys
import time

import httpx


def move(api: httpx.Client, drive: str, revolutions: float, speed_rpm: float) -> None:
    """One relative move in profile position mode, with limits; returns when the axis is at
    standstill.

    Raises:
        RuntimeError: the move was refused or ended early.
    """
    request = {
        "mode": "PP",
        "target": revolutions,
        "relative": True,
        "speed": speed_rpm,
        "travel_limit": abs(revolutions) * 1.1,
        "torque_limit": 100,
    }
    answer = api.post(f"/drives/{drive}/jobs/move", json=request)
    if answer.is_error:
        raise RuntimeError(answer.json()["detail"])
    job = answer.json()
    while job["state"] == "running":
        time.sleep(0.05)
        job = api.get(f"/jobs/{job['id']}").raise_for_status().json()
    if job["state"] != "done":
        raise RuntimeError(job["problem"]["detail"] if job["problem"] else job["state"])


def main() -> int:
    drive, revolutions, speed = sys.argv[1], float(sys.argv[2]), float(sys.argv[3])
    server = os.environ.get("SERVODECK_SERVER", "http://127.0.0.1:8420")
    token = os.environ.get("SERVODECK_TOKEN")
    headers = {"Authorization": f"Bearer {token}"} if token else {}
    with httpx.Client(base_url=f"{server}/api/v1", headers=headers, timeout=60) as api:
        try:
            for way in (revolutions, -revolutions):
                move(api, drive, way, speed)
                state = api.get(f"/drives/{drive}/state").raise_for_status().json()
                print(f"{state['position']:.3f} rev, {state['state']}")
        except KeyboardInterrupt:
            api.post("/stop", json={})
            print("STOP", file=sys.stderr)
            return 130
        except RuntimeError as error:
            print(f"error: {error}", file=sys.stderr)
            return 1
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
