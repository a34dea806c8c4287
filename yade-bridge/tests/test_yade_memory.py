"""The search for fields of YADE's objects in memory, on objects of our own."""

import ctypes
import struct

import numpy as np
import pytest

from concordem import YadeError, _core
from concordem.yade._memory import Finder, image_of, known_pointer, memory, usable_size

libc = ctypes.CDLL(None)
libc.malloc.restype, libc.malloc.argtypes = ctypes.c_void_p, [ctypes.c_size_t]
libc.free.argtypes = [ctypes.c_void_p]


def neighbors(size, count=10_000):
    """Two blocks of the heap of which one follows the other directly. Many are made, since earlier tests leave single free ones."""
    made = sorted(libc.malloc(size) for _ in range(count))
    step = size + 8  # glibc's header
    first = next(a for a, b in zip(made, made[1:]) if b - a == step)
    return first, first + step, made


def test_the_size_of_a_block_is_known():
    for size in (24, 56, 120, 1000, 4088):
        address = libc.malloc(size)
        # Rounded up to 16 bytes; glibc leaves up to 16 more, as it splits off no remainder below 32.
        assert size <= usable_size(address) < size + 32
        libc.free(address)
    # Not the beginning of a block.
    address = libc.malloc(120)
    ctypes.memset(address, 0xFF, 120)
    assert usable_size(address + 64) == 0
    libc.free(address)


def test_an_object_is_read_to_the_end_of_its_block():
    one, two, made = neighbors(56)
    ctypes.memset(one, 1, 56)
    ctypes.memset(two, 2, 56)
    assert image_of(one, 1024) == b"\1" * 56 and image_of(one, 24) == b"\1" * 24
    # An address within a block, as that of an object whose size another allocator keeps elsewhere: all that was asked for.
    block = libc.malloc(120)
    ctypes.memset(block, 0xFF, 120)
    assert usable_size(block + 64) == 0 and len(image_of(block + 64, 1024)) == 1024
    for address in (*made, block):
        libc.free(address)


def test_without_a_size_a_second_place_is_an_error():
    """Numbers that stand in the object and once more behind it, for an allocator that tells no size."""
    block = libc.malloc(120)
    ctypes.memset(block, 0xFF, 120)
    finder = Finder("Interaction")
    for number in (3, 70001):
        for address in (block + 72, block + 104):
            ctypes.memmove(address, struct.pack("<i", number), 4)
        finder.observe("id1", block + 64, struct.pack("<i", number))
    with pytest.raises(YadeError, match="found at 2 offsets instead of one"):
        finder.offset("id1")
    libc.free(block)


def test_a_field_is_not_found_in_the_next_object():
    """The next object of the heap may have the same numbers, as interactions have the ids of erased ones."""
    one, two, made = neighbors(56)
    finder = Finder("Interaction")
    for number in (3, 70001):
        for address in (one, two):
            ctypes.memset(address, 0, 56)
            ctypes.memmove(address + 16, struct.pack("<2i", number, number + 1), 8)
        finder.observe("id1", one, struct.pack("<i", number))
        finder.observe("id2", one, struct.pack("<i", number + 1))
    assert (finder.offset("id1"), finder.offset("id2")) == (16, 20)
    for address in made:
        libc.free(address)


def test_pointers():
    box = ctypes.c_uint64(77)
    assert known_pointer(ctypes.addressof(box)) == memory.pointer(ctypes.addressof(box)) == 77


def test_fields_are_written_and_read_object_by_object():
    """Words and single bytes, in any order of the fields; what lies between them stays."""
    objects = [(ctypes.c_uint8 * 64)(*range(k, 64 + k)) for k in (0, 100)]
    addresses = np.array([ctypes.addressof(one) for one in objects], np.uint64)
    pair, one = np.array([1.5, -2.0, 3.25, 4.0]), np.array([5.0, 6.0])
    found = _core.memory_exchange(addresses, [(8, pair), (40, one)], [(40, 8), (3, 5), (8, 16)])
    assert found.shape == (2, 29)
    for k, row in enumerate(found):
        assert row[:8].tobytes() == one[k].tobytes() and row[13:].tobytes() == pair[2 * k : 2 * k + 2].tobytes()
        assert row[8:13].tolist() == [n + 100 * k for n in range(3, 8)]
        assert list(objects[k])[:8] == [n + 100 * k for n in range(8)] and list(objects[k])[48:] == [n + 100 * k for n in range(48, 64)]
    assert (_core.memory_rows(addresses, [(40, 8), (3, 5), (8, 16)]) == found).all()
    assert _core.memory_rows(addresses[:0], [(0, 8)]).shape == (0, 8)
    with pytest.raises(ValueError, match="3 numbers cannot be distributed evenly to 2 objects"):
        _core.memory_exchange(addresses, [(0, pair[:3])], [])
