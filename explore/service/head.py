"""HEAD wherever there is GET: the same head of the answer, without its body. FastAPI's routes have no HEAD."""

from __future__ import annotations

import asyncio

from starlette.types import ASGIApp, Message, Receive, Scope, Send


class Head:
    """Answers HEAD by what GET answers, up to the first part of the body."""

    def __init__(self, app: ASGIApp) -> None:
        self._application = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request."""
        if scope["type"] != "http" or scope["method"] != "HEAD":
            await self._application(scope, receive, send)
            return
        has_answered = asyncio.Event()

        async def send_head(message: Message) -> None:
            if message["type"] == "http.response.start":
                await send(message)
                await send({"type": "http.response.body", "body": b""})
                has_answered.set()

        answering = asyncio.ensure_future(self._application({**scope, "method": "GET"}, receive, send_head))
        waiting = asyncio.ensure_future(has_answered.wait())
        await asyncio.wait({answering, waiting}, return_when=asyncio.FIRST_COMPLETED)
        waiting.cancel()
        answering.cancel()  # the body of a file is long, and that of a stream of events has no end
        await asyncio.wait({answering})
        if not answering.cancelled() and (error := answering.exception()) is not None:
            raise error
