"""Measure the inertia of an axis. THE AXIS MOVES. Ctrl+C stops it.

    python inertia.py DRIVE_ID TRAVEL_REV SPEED_RPM TORQUE_PERCENT

The server is named by SERVODECK_SERVER, a token by SERVODECK_TOKEN.
"""

import os
import sys
import time

import httpx


def wait(api: httpx.Client, job: dict) -> dict:
    """Show the progress of a job until it ends; cancel it at Ctrl+C."""
    step = ""
    try:
        while job["state"] == "running":
            if job["step"] != step:
                step = job["step"]
                print(f"  {job['progress']:4.0%}  {step}")
            time.sleep(0.1)
            job = api.get(f"/jobs/{job['id']}").raise_for_status().json()
    except KeyboardInterrupt:
        api.delete(f"/jobs/{job['id']}")
        raise
    return job


def main() -> int:
    drive, travel, speed, torque = sys.argv[1], *map(float, sys.argv[2:5])
    server = os.environ.get("SERVODECK_SERVER", "http://127.0.0.1:8420")
    token = os.environ.get("SERVODECK_TOKEN")
    headers = {"Authorization": f"Bearer {token}"} if token else {}
    limits = {"travel_limit": travel, "speed_limit": speed, "torque_limit": torque}
    with httpx.Client(base_url=f"{server}/api/v1", headers=headers, timeout=60) as api:
        answer = api.post(f"/drives/{drive}/jobs/inertia", json=limits)
        if answer.is_error:
            problem = answer.json()
            print(f"{problem['detail']}\ntry: {problem['remedy']}", file=sys.stderr)
            return 1
        job = wait(api, answer.json())
        if job["state"] != "done":
            detail = job["problem"]["detail"] if job["problem"] else ""
            print(f"{job['state']}: {detail}", file=sys.stderr)
            return 1
        result = job["result"]
        low, high = result["ci95"]["inertia_kgm2"]
        print(f"inertia {result['inertia_kgm2']:.4g} kg·m² ({low:.4g} to {high:.4g}, 95 %)")
        print(f"Coulomb friction {result['coulomb_nm']:.3g} N·m")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
