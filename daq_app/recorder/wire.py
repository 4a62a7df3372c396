"""Messages as bytes on a pipe: a length of four bytes, then MessagePack of [name, fields]. Nothing in it can be run."""

import struct
from collections.abc import Iterable
from typing import Any, cast

import msgspec
import numpy as np
from numpy.typing import NDArray

LENGTH = struct.Struct("<I")
LONGEST = 256 * 2**20  # a longer message is none of ours [bytes]


class BrokenMessage(Exception):
    """What came down the pipe is no message of ours."""


class Codec:
    """Packs and unpacks messages of the types it was given; a type is known by its name."""

    def __init__(self, types: Iterable[type]) -> None:
        """Know these types, none of which share a name."""
        self._types = {cls.__name__: cls for cls in types}

    def packed(self, message: object) -> bytes:
        """Return a message as bytes."""
        body = msgspec.msgpack.encode((type(message).__name__, message), enc_hook=_array_out)
        return LENGTH.pack(len(body)) + body

    def unpacked(self, body: bytes) -> Any:  # noqa: ANN401  one of the types it was given
        """Return the message of these bytes, the length not among them. Raises BrokenMessage."""
        try:
            name, fields = msgspec.msgpack.decode(body, type=tuple[str, msgspec.Raw])
            cls: Any = self._types[name]
            return msgspec.msgpack.decode(fields, type=cls, dec_hook=_array_in)
        except (KeyError, ValueError, TypeError, msgspec.MsgspecError) as error:
            raise BrokenMessage(f"a message that is none of ours ({error})") from error


class Splitter:
    """Cuts a stream of bytes into the bodies of messages, however it was cut before."""

    def __init__(self) -> None:
        self._buffer = bytearray()

    def feed(self, data: bytes) -> list[bytes]:
        """Take what arrived and return every body it completes. Raises BrokenMessage for a length beyond LONGEST."""
        self._buffer += data
        messages: list[bytes] = []
        start = 0
        while len(self._buffer) - start >= LENGTH.size:
            (length,) = LENGTH.unpack_from(self._buffer, start)
            if length > LONGEST:
                raise BrokenMessage(f"a message of {length} bytes is none of ours")
            stop = start + LENGTH.size + length
            if len(self._buffer) < stop:
                break
            messages.append(bytes(self._buffer[start + LENGTH.size : stop]))
            start = stop
        del self._buffer[:start]
        return messages


def _array_out(value: object) -> object:
    """Return an array as its kind, shape and bytes."""
    if isinstance(value, np.ndarray):
        array = cast("NDArray[Any]", value)
        return array.dtype.str, array.shape, array.tobytes()
    raise NotImplementedError(type(value).__name__)


def _array_in(_: type, value: Any) -> NDArray[Any]:  # noqa: ANN401  what MessagePack holds
    """Return the array that `_array_out` gave this for. Raises ValueError where it is none of numbers."""
    kind, shape, content = value
    dtype = np.dtype(kind)
    if dtype.kind not in "if":
        raise ValueError(f"an array of kind {kind}")
    return np.frombuffer(content, dtype).reshape(shape)
