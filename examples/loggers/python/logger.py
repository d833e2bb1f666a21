"""A logger that writes one line of text for every record, as an operator would read it in a terminal.

It keeps each record exactly once, whatever happens to it: after a kill it looks into its own file for what it has.
"""

import json
import os
from datetime import datetime, timezone

from componentize_py_types import Err
from wit_world import exports
from wit_world.imports.types import Entry, Value

# The only directory there is: the one that the plant file grants.
FOLDER = "/data"


# Every call gets a new `Sink`: what stays from call to call stands here.
file = None
last = 0


class Sink(exports.Sink):
    def open(self, config: str) -> None:
        global file, last
        own = json.loads(config).get("config", {})
        path = os.path.join(FOLDER, own.get("file", "records.txt"))
        try:
            last = last_number(path) if os.path.exists(path) else 0
            file = open(path, "ab")
        except OSError as error:
            # What is raised as Err is the sentence that the plant's operator gets to read.
            raise Err(f"{path} cannot be opened: {error.strerror}; does the plant file grant a `directory`?")

    def write(self, batch: list[Entry]) -> int:
        global last
        # After a kill the plant offers again what it does not know to be kept.
        new = [entry for entry in batch if entry.seq > last]
        try:
            file.write("".join(map(line, new)).encode())
            file.flush()
            os.fsync(file.fileno())
        except OSError as error:
            raise Err(f"the disk refused {len(new)} records: {error.strerror}")
        last = max(last, batch[-1].seq)
        return batch[-1].seq


def last_number(path: str) -> int:
    """The number in the last whole line; a line that was cut off by a kill is removed."""
    with open(path, "r+b") as old:
        size = old.seek(0, os.SEEK_END)
        tail_from = max(0, size - 65536)
        old.seek(tail_from)
        tail = old.read()
        whole = tail.rfind(b"\n") + 1
        if whole == 0 and tail_from > 0:
            raise Err(f"{path} does not end with lines; it is left alone")
        old.truncate(tail_from + whole)
    lines = tail[:whole].splitlines()
    return int(lines[-1].split(None, 1)[0]) if lines else 0


def line(entry: Entry) -> str:
    time = datetime.fromtimestamp(entry.time // 10**9, timezone.utc).strftime("%Y-%m-%d %H:%M:%S")
    milliseconds = entry.time // 10**6 % 1000
    what = [entry.kind.name.lower(), entry.source, entry.transition]
    previous, current = show(entry.previous), show(entry.current)
    if current != "-":
        what.append(f"{previous} -> {current}")
    if entry.user:
        what.append(f"by {entry.user}")
    if entry.text:
        what.append(json.dumps(entry.text, ensure_ascii=False))
    return f"{entry.seq} {time}.{milliseconds:03} {' '.join(what)}\n"


def show(value: Value) -> str:
    plain = getattr(value, "value", None)  # the case `none` carries nothing
    if plain is None:
        return "-"
    if isinstance(plain, bool):
        return "on" if plain else "off"
    return str(plain)
