"""A sweep with threads opens no socket; the processes of a sweep accept only each other."""

import contextlib
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import dask
import yaml

from clusters.processes import Cluster, Sweep, digest, study_file

#: The flag of a listening Unix socket in /proc/net/unix.
_ACCEPTS = 0x1_0000

#: Another user's attack on every port: to get an answer in plain text, over TLS without a certificate, over TLS with a
#: certificate made here; and to run code. Prints the attempts that succeed. The superuser switches to a user without
#: rights after Python has loaded its modules; any other user attacks with his own rights, which are greater.
_ATTACK = """
import os, socket, ssl, sys
from concurrent.futures import ThreadPoolExecutor
from distributed import Client, Security

own = Security.temporary()
without = ssl.create_default_context()
without.check_hostname, without.verify_mode = False, ssl.CERT_NONE
foreign = own.get_connection_args("client")["ssl_context"]
foreign.verify_mode = ssl.CERT_NONE

def talk(port):
    for name, context in {"plain": None, "no certificate": without, "a foreign certificate": foreign}.items():
        try:
            with socket.create_connection(("127.0.0.1", port), timeout=1) as connection:
                with context.wrap_socket(connection) if context else connection as stream:
                    if context is None:
                        stream.sendall(b"GET / HTTP/1.0\\r\\n\\r\\n")
                    reply = stream.recv(100)
        except OSError:
            continue
        if reply and reply[0] != 21:  # an alert of TLS
            print(port, "answered", name, reply)

def command(port):
    for url, security in ((f"tcp://127.0.0.1:{port}", None), (f"tls://127.0.0.1:{port}", own)):
        try:
            with Client(url, security=security, timeout=1, set_as_default=False) as client:
                print("code of", os.getuid(), "ran as", client.run_on_scheduler(os.getuid))
        except Exception:  # of many types: a handshake with a port that does not speak TLS raises a ValueError
            pass

talk(1), command(1)  # nobody is there
if os.getuid() == 0:
    os.setgroups([]), os.setgid(65_534), os.setuid(65_534)
ports = [int(port) for port in sys.argv[1:]]
with ThreadPoolExecutor(len(ports)) as pool:
    list(pool.map(talk, ports))
    list(pool.map(command, ports))
print("tried", len(ports), "as", os.getuid())
"""


def listening_sockets(pids: list[int]) -> list[int | str]:
    """Ports and names of Unix sockets on which processes listen."""
    ours = set().union(*map(_sockets, pids))
    sockets: list[int | str] = []
    for table in ("tcp", "tcp6", "udp", "udp6"):
        for line in Path(f"/proc/self/net/{table}").read_text().splitlines()[1:]:
            fields = line.split()
            if fields[9] in ours and (fields[3] == "0A" or table.startswith("udp")):
                sockets.append(int(fields[1].rpartition(":")[2], 16))
    for line in Path("/proc/self/net/unix").read_text().splitlines()[1:]:
        fields = line.split()
        if fields[6] in ours and int(fields[3], 16) & _ACCEPTS:
            sockets.append(fields[7] if len(fields) > 7 else "unnamed")
    return sockets


def _sockets(pid: int) -> set[str]:
    """Inodes of the open sockets of a process."""
    inodes = set()
    for descriptor in Path(f"/proc/{pid}/fd").iterdir():
        with contextlib.suppress(OSError):
            kind, _, inode = str(descriptor.readlink()).partition(":[")
            if kind == "socket":
                inodes.add(inode.rstrip("]"))
    return inodes


def attack(ports: list[int | str]) -> list[str]:
    """The attempts of `_ATTACK` that succeed at these ports."""
    command = [sys.executable, "-c", _ATTACK, *map(str, ports)]
    surrounding = {name: value for name, value in os.environ.items() if name != "DASK_CONFIG"}  # a stranger has no key
    process = subprocess.run(
        command, cwd="/", env=surrounding, capture_output=True, text=True, timeout=240, check=False
    )
    *successes, last = process.stdout.splitlines() or [""]
    assert last == f"tried {len(ports)} as {os.getuid() or 65_534}", process.stderr
    return successes


def test_a_sweep_with_threads_opens_no_socket(folder):
    with Sweep(study_file(folder, 20), folder / "a.h5", "--workers", "2", "--quiet", seconds=0.3) as sweep:
        sweep.at_work()
        assert listening_sockets(sweep.members) == []


def test_a_sweep_with_processes_refuses_other_users_and_keeps_its_key(folder):
    options = ("--workers", "2", "--processes", "--quiet")
    with Sweep(study_file(folder, 40), folder / "a.h5", *options, seconds=1) as sweep:
        sweep.at_work()
        ports = listening_sockets(sweep.members)
        assert len(ports) == 5, "a scheduler, and two workers with one that watches over each"
        assert attack(ports) == []
        for pid in sweep.members:
            for name in ("cmdline", "environ"):
                assert b"PRIVATE KEY" not in Path(f"/proc/{pid}/{name}").read_bytes()
        assert sweep.process.poll() is None


def test_the_attack_succeeds_on_an_unprotected_cluster(cluster: Cluster):
    """The control of the test above."""
    successes = attack([int(cluster.address.rpartition(":")[2])])
    assert [line for line in successes if line.endswith(f"ran as {os.getuid()}")]
    assert [line for line in successes if "answered plain" in line]


def test_a_cluster_protected_as_documented_serves_the_sweep_and_refuses_other_users(
    folder, expected_digest, monkeypatch
):
    blocks, path = 4, folder / "a.h5"
    text = (Path(__file__).parents[2] / "docs" / "sweeps.md").read_text()
    (command,) = re.findall(r"^openssl req .*$", text, re.MULTILINE)
    (settings,) = re.findall(r"```yaml\n(.*?)```", text, re.DOTALL)
    subprocess.run(shlex.split(command), cwd=folder, check=True, capture_output=True)
    (folder / "tls.yaml").write_text(settings.replace("/home/me/keys", str(folder)))
    monkeypatch.setenv("DASK_CONFIG", str(folder))
    ours = yaml.safe_load((folder / "tls.yaml").read_text())
    with dask.config.set(dask.config.merge(dask.config.config, ours)), Cluster(folder, "tls") as cluster:
        cluster.add_worker()
        cluster.wait_for_workers(1)
        with Sweep(study_file(folder, blocks), path, "--scheduler", cluster.address, "--quiet") as sweep:
            assert sweep.end() == (0, [])
        assert attack([int(cluster.address.rpartition(":")[2])]) == []
    assert cluster.address.startswith("tls://")
    assert digest(path) == expected_digest(blocks)
