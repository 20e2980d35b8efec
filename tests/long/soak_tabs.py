"""Opens and closes tabs of a page at random until standard input ends; prints how many."""

import asyncio
import contextlib
import random
import sys

from tornado.websocket import WebSocketClientConnection, WebSocketClosedError, websocket_connect

MOST_TABS = 10
"""Tabs that are open at once."""

PAUSE = 0.5
"""Mean time between two changes [s]."""

DRAWN = "drawn"
"""What a page answers to a picture."""


async def main(url: str, seed: int) -> int:
    """Return the number of tabs opened."""
    choice = random.Random(seed)
    tabs: list[WebSocketClientConnection] = []
    ended = asyncio.get_running_loop().run_in_executor(None, sys.stdin.readline)
    n = 0
    while not ended.done():
        if len(tabs) < MOST_TABS and choice.random() < 0.55:
            tabs.append(await opened(url, reads=choice.random() < 0.7))
            n += 1
        elif tabs:
            tab = tabs.pop(choice.randrange(len(tabs)))
            if choice.random() < 0.5:
                tab.close()
            else:
                tab.stream.close()  # as if the browser had crashed
        await asyncio.wait([ended], timeout=choice.expovariate(1.0 / PAUSE))
    return n


async def opened(url: str, reads: bool) -> WebSocketClientConnection:
    """Return a tab that draws what it is sent, or one that never answers."""

    def drawn(message: str | bytes | None) -> None:
        if reads and message is not None:
            with contextlib.suppress(WebSocketClosedError):
                tab.write_message(DRAWN)

    address = url.replace("http", "ws") + "frames"
    tab = await websocket_connect(address, on_message_callback=drawn)
    return tab


if __name__ == "__main__":
    print(asyncio.run(main(sys.argv[1], int(sys.argv[2]))))
