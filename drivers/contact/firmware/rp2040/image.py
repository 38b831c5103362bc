#!/usr/bin/env python3
"""The program for the board on Ethernet as a file that the board's drive takes (UF2).

    image.py cellcal-sensor-eth.bin board.uf2
    image.py cellcal-sensor-eth.bin board.uf2 --address 192.168.0.20/24 --port 4300 --number 2

Writes the checksum of the second stage, and the board's address, port and number: each board on a
network has a number of its own, which its hardware address ends with."""

import argparse
import ipaddress
import struct
import sys

BOOT, FLASH, BLOCK = 256, 0x10000000, 256
MAGIC = b"cellcal1"
UF2_BEGIN, UF2_END, FAMILY, HAS_FAMILY = (0x0A324655, 0x9E5D5157), 0x0AB16F30, 0xE48BFF56, 0x2000


def crc(data):
    """CRC-32, polynomial 04C11DB7, start all ones, neither reflected nor inverted."""
    value = 0xFFFFFFFF
    for byte in data:
        value ^= byte << 24
        for _ in range(8):
            value = (value << 1 ^ (0x04C11DB7 if value & 0x80000000 else 0)) & 0xFFFFFFFF
    return value


def settle(image, address, port, number):
    at = image.index(MAGIC) + len(MAGIC)
    if image.count(MAGIC) != 1:
        sys.exit("image.py: the image has no settings, or several")
    network = ipaddress.ip_interface(address)
    mac = bytes([0x02]) + b"cel" + struct.pack(">H", number)
    image[at:at + 16] = network.ip.packed + network.netmask.packed + mac + struct.pack(">H", port)


def uf2(image):
    image += b"\xff" * (-len(image) % BLOCK)
    blocks = len(image) // BLOCK
    for i in range(blocks):
        head = struct.pack("<8I", *UF2_BEGIN, HAS_FAMILY, FLASH + i * BLOCK, BLOCK, i, blocks, FAMILY)
        yield head + image[i * BLOCK:(i + 1) * BLOCK] + bytes(476 - BLOCK) + struct.pack("<I", UF2_END)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("binary")
    parser.add_argument("uf2")
    parser.add_argument("--address", default="169.254.67.84/16")
    parser.add_argument("--port", type=int, choices=range(1, 65536), metavar="PORT", default=4300)
    parser.add_argument("--number", type=int, choices=range(1, 65536), metavar="NUMBER", default=1)
    options = parser.parse_args()
    with open(options.binary, "rb") as f:
        image = bytearray(f.read())
    settle(image, options.address, options.port, options.number)
    image[BOOT - 4:BOOT] = struct.pack("<I", crc(image[:BOOT - 4]))
    with open(options.uf2, "wb") as f:
        f.writelines(uf2(image))


if __name__ == "__main__":
    main()
