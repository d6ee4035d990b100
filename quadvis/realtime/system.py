"""What a loop asks of Linux: a real-time priority, a processor, memory that stays, exact timers.

Each wish is tried by itself. What is not granted does not stop a run, but is reported with its reason.
"""

from __future__ import annotations

import ctypes
import errno
import gc
import os
import resource
from collections.abc import Callable
from dataclasses import dataclass, field

from quadvis.machine.files import reason
from quadvis.realtime.clocks import Timekeeper
from quadvis.realtime.options import RealTime

CAP_IPC_LOCK, CAP_SYS_NICE = 14, 23
PR_SET_TIMERSLACK = 29
MCL_CURRENT, MCL_FUTURE = 1, 2
AMPLE = 4  # later allocations fail where future memory is locked under a limit that is near

TRIALS = 200  # sleeps whose lateness is measured
TRIAL = 500_000  # ns that each lasts
LATEST = 0.99  # of these sleeps end within the time that is polled then
SHARE = 10  # at most one in so many parts of the period is polled without being asked for


@dataclass
class Grants:
    """What the system has granted, and what it has not and why."""

    granted: list[str] = field(default_factory=list)
    refused: list[str] = field(default_factory=list)

    def ask(self, what: str, request: Callable[[], str]) -> None:
        """Try a wish; ``request`` returns why it is not granted, or ""."""
        why = request()
        if why:
            self.refused.append(f"{what} ({why})")
        else:
            self.granted.append(what)

    def __str__(self) -> str:
        granted = ", ".join(self.granted) or "nothing granted"
        return f"{granted}; not granted: {', '.join(self.refused)}" if self.refused else granted


def ask_all(wishes: RealTime) -> Grants:
    """Ask for everything, for the calling thread and its process."""
    grants = Grants()
    gc.collect()
    gc.freeze()
    gc.disable()
    priority = wishes.priority
    if priority:
        grants.ask(f"SCHED_FIFO {priority}", lambda: raise_thread(priority))
    cpu = wishes.cpu
    if cpu is not None:
        grants.ask(f"cpu {cpu}", lambda: _processor(cpu))
    grants.ask("memory locked", _lock_memory)
    grants.ask("timers exact", _exact_timers)
    grants.granted.append("gc off")
    return grants


def raise_thread(priority: int) -> str:
    """Ask for a real-time priority of the calling thread; return why it is not granted, or ""."""
    try:
        # Threads and processes that blocks begin later do not inherit the priority.
        policy = os.SCHED_FIFO | os.SCHED_RESET_ON_FORK
        os.sched_setscheduler(0, policy, os.sched_param(priority))
    except OSError as error:
        if error.errno == errno.EPERM and _has(CAP_SYS_NICE):
            return "the control group has no time for it: cpu.rt_runtime_us is 0"
        if error.errno == errno.EPERM:
            limit = resource.getrlimit(resource.RLIMIT_RTPRIO)[0]
            return f"needs CAP_SYS_NICE, or a limit rtprio of {priority}; it is {limit}"
        return reason(error)
    return ""


def _processor(cpu: int) -> str:
    try:
        os.sched_setaffinity(0, {cpu})
    except (OSError, OverflowError, ValueError):
        allowed = ", ".join(map(str, sorted(os.sched_getaffinity(0))))
        return f"this process may use {allowed}"
    return ""


def _lock_memory() -> str:
    limit = resource.getrlimit(resource.RLIMIT_MEMLOCK)[0]
    used = _memory_in_use()
    ample = limit == resource.RLIM_INFINITY or _has(CAP_IPC_LOCK) or limit >= AMPLE * used
    if not ample:
        size = f"{limit / 2**20:.0f} MB, and {used / 2**20:.0f} MB are in use"
        return f"needs CAP_IPC_LOCK, or a limit memlock of {AMPLE} times what is in use; it is {size}"
    number = _libc("mlockall", MCL_CURRENT | MCL_FUTURE)
    return os.strerror(number).lower() if number else ""


def _exact_timers() -> str:
    number = _libc("prctl", PR_SET_TIMERSLACK, 1, 0, 0, 0)
    return os.strerror(number).lower() if number else ""


def _libc(name: str, *arguments: int) -> int:
    """Call a function of the C library; return the number of its error, or 0."""
    library = ctypes.CDLL(None, use_errno=True)
    found = getattr(library, name)(*map(ctypes.c_ulong, arguments))
    return ctypes.get_errno() if found else 0


def _has(capability: int) -> bool:
    """Return whether this process has a capability."""
    return bool(int(_status("CapEff"), 16) >> capability & 1)


def _memory_in_use() -> int:
    """Return the bytes that this process has, as the limit counts them."""
    return int(_status("VmSize").split()[0]) << 10


def _status(key: str) -> str:
    with open("/proc/self/status", encoding="ascii") as lines:
        return next(line.partition(":")[2].strip() for line in lines if line.startswith(f"{key}:"))


def wake_up_time(clock: Timekeeper) -> int:
    """Return how late (ns) the system wakes this thread, but for one time in a hundred."""
    late = []
    instant = clock.now()
    for _ in range(TRIALS):
        instant = max(instant, clock.now()) + TRIAL
        clock.sleep(instant)
        late.append(clock.now() - instant)
    return sorted(late)[int(LATEST * TRIALS)]
