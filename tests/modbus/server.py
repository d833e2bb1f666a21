"""A Modbus server of pymodbus for the tests of the drivers.

    python server.py tcp 127.0.0.1 PORT
    python server.py rtu DEVICE BAUD

Prints {"ready": true} when it serves. Then it obeys one JSON command a line and answers each with one line:
    {"busy": true}                                            input registers answer "busy" from now on, or no longer
    {"read": "holding", "address": 10, "count": 2}            entries of a table
    {"decode": "FLOAT32", "order": "little", "address": 10}   holding registers, decoded by pymodbus
It ends with its standard input, so it never outlives the test.
"""

import asyncio
import json
import os
import sys

from pymodbus.client.mixin import ModbusClientMixin
from pymodbus.constants import ExcCodes
from pymodbus.server import ModbusSerialServer, ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice

UNIT = 7
FUNCTIONS = {"coil": 1, "discrete": 2, "holding": 3, "input": 4}
TYPES = ModbusClientMixin.DATATYPE

# What the input registers hold, encoded by pymodbus itself: (address, type, value, order).
VALUES = [
    (0, TYPES.UINT16, 65535, "big"),
    (1, TYPES.INT16, -2, "big"),
    (2, TYPES.UINT32, 305419896, "big"),
    (4, TYPES.INT32, -123456, "big"),
    (6, TYPES.FLOAT32, -12.25, "big"),
    (8, TYPES.FLOAT64, 1.1, "big"),
    (12, TYPES.UINT32, 305419896, "little"),
    (14, TYPES.INT32, -123456, "little"),
    (16, TYPES.FLOAT32, -12.25, "little"),
    (18, TYPES.FLOAT64, 1.1, "little"),
]

busy = False


async def action(function, _start, _address, _count, _registers, _values):
    return ExcCodes.DEVICE_BUSY if busy and function == FUNCTIONS["input"] else None


def device():
    inputs = []
    for _address, kind, value, order in VALUES:
        inputs += ModbusClientMixin.convert_to_registers(value, kind, word_order=order)
    # Addresses that are not named here do not exist.
    return SimDevice(
        id=UNIT,
        simdata=(
            [SimData(0, values=[False] * 32, datatype=DataType.BITS)],
            [SimData(0, values=[n % 3 == 0 for n in range(20)], datatype=DataType.BITS)],
            [SimData(0, values=[0] * 64, datatype=DataType.REGISTERS)],
            [SimData(0, values=inputs, datatype=DataType.REGISTERS)],
        ),
        action=action,
    )


async def obey(server, command):
    global busy
    if "busy" in command:
        busy = command["busy"]
        return {"done": True}
    if "read" in command:
        found = await server.async_getValues(UNIT, FUNCTIONS[command["read"]], command["address"], command["count"])
        return {"values": [int(v) for v in found]} if isinstance(found, list) else {"refused": str(found)}
    kind = TYPES[command["decode"]]
    found = await server.async_getValues(UNIT, FUNCTIONS["holding"], command["address"], kind.value[1])
    return {"value": ModbusClientMixin.convert_from_registers(found, kind, word_order=command["order"])}


def say(answer):
    print(json.dumps(answer), flush=True)


async def main():
    if sys.argv[1] == "tcp":
        server = ModbusTcpServer(device(), address=(sys.argv[2], int(sys.argv[3])))
    else:
        server = ModbusSerialServer(device(), port=sys.argv[2], baudrate=int(sys.argv[3]), parity="N")
    await server.serve_forever(background=True)
    say({"ready": True})
    loop = asyncio.get_running_loop()
    while line := await loop.run_in_executor(None, sys.stdin.readline):
        say(await obey(server, json.loads(line)))
    os._exit(0)


asyncio.run(main())
