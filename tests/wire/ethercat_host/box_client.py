"""A browser on the office's port, for a test: sets a station up, then asks it what is allowed.

    python box_client.py ADDRESS CODE PORT_OF_ETHERCAT PORT_OF_OFFICE NAME

Prints what came of each step as JSON. The station's certificate is its own.
"""

from __future__ import annotations

import asyncio
import json
import socket
import ssl
import sys
from typing import Any

import httpx

PASSWORD = "eleven blue horses"


def ask(http: httpx.Client, method: str, path: str, body: object = None) -> Any:
    answer = http.request(method, f"/api/v1{path}", json=body)
    said = answer.json() if answer.content else None
    return {"status": answer.status_code, "said": said}


def scanned(http: httpx.Client, port: str) -> Any:
    begun = ask(http, "POST", "/scan", {"url": f"ethercat://{port}"})
    while begun["status"] == 202:
        job = ask(http, "GET", f"/jobs/{begun['said']['id']}")
        if job["said"]["state"] != "running":
            return job
    return begun


async def resolved(name: str, address: str) -> list[str]:
    from zeroconf import AddressResolver, IPVersion
    from zeroconf.asyncio import AsyncZeroconf

    asking = AsyncZeroconf(interfaces=[address], ip_version=IPVersion.V4Only)
    try:
        found = AddressResolver(f"{name}.local.")
        await found.async_request(asking.zeroconf, 5000)
        return [socket.inet_ntoa(one) for one in found.addresses]
    finally:
        await asking.async_close()


def trusted(http: httpx.Client, name: str) -> list[str]:
    """What somebody who has installed the station's authority sees under its name."""
    authority = http.get("/api/v1/certificate").text
    trusting = ssl.create_default_context(cadata=authority)
    place = (http.base_url.host, http.base_url.port or 443)
    with (
        socket.create_connection(place) as plain,
        trusting.wrap_socket(plain, server_hostname=name) as line,
    ):
        said = line.getpeercert() or {}
    return [value for kind, value in said["subjectAltName"] if value == name and kind == "DNS"]


def main(address: str, code: str, ethercat: str, office: str, name: str) -> None:
    done: dict[str, Any] = {}
    with httpx.Client(base_url=address, verify=False, timeout=30) as http:
        if code == "resolve":
            host = httpx.URL(address).host
            done["resolved"] = asyncio.run(resolved(name, host))
            done["by name"] = http.get(
                "/api/v1/health", headers={"Host": f"{name}.local"}
            ).status_code
            done["trusted"] = trusted(http, f"{name}.local")
            print(json.dumps(done))
            return
        for path in ("/box", "/drives", "/interfaces", "/log", "/openapi.json", "/accounts"):
            done[f"before {path}"] = ask(http, "GET", path)["status"]
        body = {"code": "wrong-wrong-wrong", "name": "Anna", "password": PASSWORD}
        done["wrong code"] = ask(http, "POST", "/setup", body)["status"]
        made = ask(http, "POST", "/setup", {**body, "code": code})
        done["set up"] = made["status"]
        http.headers["X-Servodeck-CSRF"] = made["said"]["csrf"]
        done["second"] = ask(http, "POST", "/setup", {**body, "code": code})["status"]
        done["box"] = ask(http, "GET", "/box")["said"]
        cut = {"name": name, "ethercat": office, "office": ""}
        done["cut off"] = ask(http, "PUT", "/box", cut)["said"]
        done["roles"] = ask(
            http, "PUT", "/box", {"name": name, "ethercat": ethercat, "office": office}
        )
        done["scan of the office"] = scanned(http, office)
        done["scan of the drives"] = scanned(http, ethercat)
    print(json.dumps(done))


if __name__ == "__main__":
    main(*sys.argv[1:])
