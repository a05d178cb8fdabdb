"""Other processes, each on the one core of the comparison, with the CPU seconds that they took."""

import os
import signal
import subprocess
import threading

CORE = int(os.environ.get("PEERS_CORE", "0"))
# A candidate of a sweep that takes longer than this is given up [s].
PATIENCE = 120.0


class Failed(Exception):
    """A program that did not do what it was asked."""


def run(command, given=b"", environment=None, directory=None):
    """Standard output of the command and its CPU seconds, user and system, children that it waited for included."""
    pinned = ["taskset", "-c", str(CORE), *map(str, command)]
    pipe = subprocess.PIPE
    child = subprocess.Popen(pinned, stdin=pipe, stdout=pipe, stderr=pipe, env=environment, cwd=directory)
    outputs = {}
    readers = [threading.Thread(target=read, args=(child, name, outputs)) for name in ("stdout", "stderr")]
    writer = threading.Thread(target=feed, args=(child.stdin, given))
    limit = threading.Timer(PATIENCE, lambda: os.kill(child.pid, signal.SIGKILL))
    for thread in (*readers, writer, limit):
        thread.start()
    _, status, usage = os.wait4(child.pid, 0)
    limit.cancel()
    for thread in (*readers, writer):
        thread.join()
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode != 0:
        message = outputs["stderr"].decode(errors="replace").strip()[-500:]
        raise Failed(f"{command[0]} ended with {child.returncode}: {message}")
    return outputs["stdout"], usage.ru_utime + usage.ru_stime


def read(child, name, outputs):
    outputs[name] = getattr(child, name).read()


def feed(pipe, given):
    try:
        pipe.write(given)
        pipe.close()
    except BrokenPipeError:
        pass
