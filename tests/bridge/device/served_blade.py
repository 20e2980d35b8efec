"""A blade that notes what a device asks of it, and a server of it in a thread."""

import contextlib
import threading

import numpy as np

from bridge import CartesianPose, DeviceDescription, DeviceServer, DeviceState
from tissue import Wrench

ORIGIN = np.zeros(3)
UNTURNED = np.array([1.0, 0.0, 0.0, 0.0])
POSE = CartesianPose(ORIGIN, UNTURNED)
STATE = DeviceState(
    1.25,
    0.5,
    CartesianPose(np.array([0.1, 0.2, 0.3]), np.array([0.6, 0.0, 0.8, 0.0])),
    Wrench(np.array([1.0, 2.0, 3.0]), np.array([4.0, 5.0, 6.0]), np.array([0.1, 0.2, 0.3])),
    True,
    False,
    7,
)


class NotedBlade:
    """Notes what is asked of it, as `DrivenBlade`."""

    def __init__(self):
        self.asked = []

    def servo_cp(self, pose, *, holds, period):
        self.asked.append(("servo_cp", *pose.position.tolist(), holds))
        if pose.position[0] > 1.0:
            raise ValueError("the stylus has jumped")

    def release(self):
        self.asked.append(("release",))

    def lose_client(self):
        self.asked.append(("lose_client",))

    def end(self):
        self.asked.append(("end",))

    def state(self):
        return STATE


@contextlib.contextmanager
def served_blade(key=None, port=0):
    """Yield a blade, and the address at which a device can lead it."""
    blade, stops = NotedBlade(), threading.Event()
    with DeviceServer(
        blade, DeviceDescription("organ", 0.04, 0.2, 2.0), port=port, key=key
    ) as server:

        def serve():
            while not stops.is_set():
                server.serve_for(0.005)

        thread = threading.Thread(target=serve)
        thread.start()
        try:
            yield blade, server.address
        finally:
            stops.set()
            thread.join()
