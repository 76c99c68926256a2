"""Store a parameter set of every drive of a server in a folder. Nothing moves, nothing is written.

    python backup_all.py [FOLDER]

The server is named by SERVODECK_SERVER, a token by SERVODECK_TOKEN.
"""

import os
import sys
from pathlib import Path

import httpx


def main() -> int:
    server = os.environ.get("SERVODECK_SERVER", "http://127.0.0.1:8420")
    token = os.environ.get("SERVODECK_TOKEN")
    headers = {"Authorization": f"Bearer {token}"} if token else {}
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    folder.mkdir(parents=True, exist_ok=True)
    with httpx.Client(base_url=f"{server}/api/v1", headers=headers, timeout=60) as api:
        drives = api.get("/drives").raise_for_status().json()
        for drive in drives:
            name = f"{drive['id']}.sdset"
            request = {"file": name, "notes": "made by backup_all.py", "overwrite": True}
            answer = api.post(f"/drives/{drive['id']}/sets", json=request)
            if answer.is_error:
                print(f"{drive['name']}: {answer.json()['detail']}", file=sys.stderr)
                return 1
            stored = answer.json()
            content = api.get(f"/sets/{stored['file']}").raise_for_status().content
            (folder / name).write_bytes(content)
            print(f"{drive['name']}: {stored['count']} settings in {folder / name}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
