"""Files that cannot be used: each fault has its own words, on one line that names the file and says what to do."""

import os
import struct
from dataclasses import replace

import brdfit
import h5py
import numpy as np
import pytest
from brdfit.tables import Scattered, merl_grid, read_truth, table

SHAPE = (3, 4, 5)
CELLS = 3 * 4 * 5
SIZE = 12 + 24 * CELLS


HEADER = struct.pack("<3i", *SHAPE)


def merl(path, header=HEADER, value=1.0, count=3 * CELLS):
    path.write_bytes(header + np.full(count, value, "<f8").tobytes())


def big_endian(path):
    path.write_bytes(struct.pack(">3i", *SHAPE) + np.ones(3 * CELLS, ">f8").tobytes())


def cut_while_read(path):
    merl(path)
    path.write_bytes(path.read_bytes()[:-100])


def cut_header(path):
    path.write_bytes(HEADER[:7])


def pack(*dimensions):
    return struct.pack("<3i", *dimensions)


MERL = {
    "missing": (lambda p: None, r"no such file; check the path$"),
    "directory": (lambda p: p.mkdir(), r"is a directory; name a file in it$"),
    "pipe": (os.mkfifo, r"is not a regular file; save it to disk first$"),
    "empty": (lambda p: p.write_bytes(b""), r"is empty \(0 bytes\); copy or download it again$"),
    "short header": (cut_header, r"is cut short: 7 bytes, less than the 12 of a MERL header; copy or download it again$"),
    "truncated": (
        lambda p: merl(p, count=3 * CELLS - 1),
        rf"is cut short: {SIZE - 8} bytes of the {SIZE} of a 3 x 4 x 5 MERL table; copy or download it again$",
    ),
    "cut inside a value": (
        cut_while_read,
        rf"is cut short: {SIZE - 100} bytes of the {SIZE} of a 3 x 4 x 5 MERL table; copy",
    ),
    "trailing": (
        lambda p: merl(p, count=3 * CELLS + 2),
        rf"has 16 bytes too many: {SIZE + 16} where a 3 x 4 x 5 MERL table has {SIZE}; copy or download it again$",
    ),
    "negative": (
        lambda p: merl(p, pack(-3, -4, 5)),
        r"is no MERL table: its header says -3 x -4 x 5 cells, which must be pos",
    ),
    "zero": (
        lambda p: merl(p, pack(0, 90, 180), count=0),
        r"its header says 0 x 90 x 180 cells, which must be positive; check",
    ),
    "absurd": (
        lambda p: merl(p, pack(2**31 - 1, 2**31 - 1, 2**31 - 1)),
        r"header says 2147483647 x 2147483647 x 2147483647 cells, an absurd number; check the file$",
    ),
    "picture": (lambda p: p.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(100)), r"is no MERL table: its header says .* cells, "),
    "big-endian": (
        big_endian,
        r"is big-endian \(its header is 3 x 4 x 5 with the bytes swapped\); convert it to little-endian$",
    ),
    "text": (
        lambda p: p.write_text("wavelength, value\n400, 0.1\n"),
        r"is a text file, neither a MERL \.binary nor a brdfit \.h5 table; name the table itself$",
    ),
    "short text": (lambda p: p.write_text("hello\n"), r"is a text file, neither a MERL"),
    "text with a mark": (lambda p: p.write_text("wavelength", encoding="utf-8-sig"), r"is a text file, neither a MERL"),
    "all negative": (
        lambda p: merl(p, value=-1.0),
        r"no cell is measured: all 60 are negative or not finite; check the file$",
    ),
    "all NaN": (lambda p: merl(p, value=np.nan), r"no cell is measured: all 60 are negative or not finite; check the file$"),
    "all zero": (lambda p: merl(p, value=0.0), r"every measured value is zero: nothing to fit; check the file$"),
}


def refused(path, match):
    with pytest.raises(brdfit.InputError, match=match) as caught:
        brdfit.load(path)
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert "\n" not in message
    assert "; " in message  # what to do


@pytest.mark.parametrize(("make", "match"), MERL.values(), ids=MERL.keys())
def test_merl(tmp_path, make, match):
    make(tmp_path / "bad.binary")
    refused(tmp_path / "bad.binary", match)


def test_memory_is_not_taken_on_the_word_of_a_header(tmp_path):
    # 24 TB by its header: an allocation would fail with MemoryError, or worse not fail
    merl(tmp_path / "bad.binary", pack(10_000, 10_000, 10_000))
    refused(tmp_path / "bad.binary", r"is cut short: 1452 bytes of the 24000000000012 of a 10000 x 10000 x 10000 MERL table")


def test_path_that_cannot_be_opened(tmp_path):
    refused(tmp_path / ("x" * 300), r"cannot be opened \(File name too long\); check path and permissions$")


def test_message_stays_on_one_line(tmp_path):
    with pytest.raises(brdfit.InputError, match=r"two lines\.binary: no such file; check the path$"):
        brdfit.load(tmp_path / "two\nlines.binary")


def good(path):
    brdfit.save(table(np.ones((3, *SHAPE)), merl_grid(SHAPE), "a", angles="edge"), path)


def scattered(path):
    up = np.array([[0.0, 0.0, 1.0]] * 4)
    brdfit.save(table(np.ones((3, 4)), Scattered(up, up, np.ones(4)), "a"), path)


def edited(change, make=good):
    def build(path):
        make(path)
        with h5py.File(path, "r+") as file:
            change(file)

    return build


def swap(name, data):
    def change(file):
        del file[name]
        file[name] = data

    return change


def attribute(name, value, at="/"):
    return edited(lambda file: file[at].attrs.__setitem__(name, value))


def unread(path):
    good(path)
    path.write_bytes(path.read_bytes()[:-200])


def claim(path):
    good(path)
    with h5py.File(path, "r+") as file:
        del file["values"]
        file.create_dataset("values", shape=(3, 10**6, 10**6), dtype="f8", chunks=(1, 1000, 1000))


def foreign(path):
    with h5py.File(path, "w") as file:
        file["x"] = 1.0


HDF5 = {
    "signature only": (
        lambda p: p.write_bytes(b"\x89HDF\r\n\x1a\n"),
        r"is no HDF5 file or a damaged one \(.*\); copy or make it",
    ),
    "truncated": (unread, r"is no HDF5 file or a damaged one \(.*truncated.*\); copy or make it again$"),
    "foreign": (foreign, r"is HDF5 but not a brdfit-table; write it with brdfit\.save$"),
    "version": (attribute("version", 2), r"is a brdfit-table of version 2, this program reads 1; make it again$"),
    "no version": (
        edited(lambda f: f.attrs.__delitem__("version")),
        r"it cannot be read as one \(.*version.*\); make it again$",
    ),
    "no values": (edited(lambda f: f.__delitem__("values")), r"it cannot be read as one \(.*values.*\); make it again$"),
    "no axis": (
        edited(lambda f: f.__delitem__("layout/theta_d")),
        r"it cannot be read as one \(.*theta_d.*\); make it again$",
    ),
    "no material": (
        edited(lambda f: f.attrs.__delitem__("material")),
        r"it cannot be read as one \(.*material.*\); make it",
    ),
    "shape": (
        edited(swap("values", np.ones((3, 3, 4, 6)))),
        r"values \(3, 3, 4, 6\) and mask \(3, 4, 5\) do not fit a layout of \(3, 4, 5\); make it again$",
    ),
    "mask": (
        edited(swap("mask", np.ones((3, 4), bool))),
        r"mask \(3, 4\) do not fit a layout of \(3, 4, 5\); make it again$",
    ),
    "mask passes": (
        edited(swap("values", -np.ones((3, *SHAPE)))),
        r"its mask passes cells with a negative or non-finite value",
    ),
    "group for values": (
        edited(lambda f: (f.__delitem__("values"), f.create_group("values"))),
        r"values is not a dataset; make",
    ),
    "text for values": (edited(swap("values", "many")), r"it cannot be read as one \(.*\); make it again$"),
    "claim": (claim, r"values claims 24000000000000 bytes and the whole file has \d+; make it again$"),
    "kind": (
        attribute("kind", "cube", "layout"),
        r"the kind of its layout is 'cube', not one of half_difference, spherical, sc",
    ),
    "angles": (attribute("angles", "middle"), r"angles are 'middle', not one of edge, centre, exact; make it again$"),
    "names": (attribute("channel_names", ["R"]), r"1 channel names and 3 channels; make it again$"),
    "edges": (
        edited(swap("layout/theta_d_edges", np.arange(3.0))),
        r"theta_d has positions \(4,\) and edges \(3,\), one more",
    ),
    "descending": (
        edited(swap("layout/theta_d_edges", -np.arange(5.0))),
        r"theta_d has angles that are not finite or edges that",
    ),
    "infinite": (
        edited(swap("layout/phi_d", np.full(5, np.nan))),
        r"phi_d has angles that are not finite or edges that do not",
    ),
    "no edges": (
        edited(lambda f: f["layout"].create_dataset("phi_h", data=[1.0])),
        r"phi_h has positions or edges but not both; make it again$",
    ),
    "directions": (
        edited(swap("layout/wi", np.ones((4, 2))), scattered),
        r"wi \(4, 2\), wo \(4, 3\) and measure \(4,\) are not \[n, 3\], \[n, 3\] and \[n\]; make it again$",
    ),
    "all zero": (
        edited(swap("values", np.zeros((3, *SHAPE)))),
        r"every measured value is zero: nothing to fit; check the file$",
    ),
    "all masked": (
        edited(swap("mask", np.zeros(SHAPE, bool))),
        r"no cell is measured: all 60 are negative or not finite; check",
    ),
}


@pytest.mark.parametrize(("make", "match"), HDF5.values(), ids=HDF5.keys())
def test_hdf5(tmp_path, make, match):
    make(tmp_path / "bad.h5")
    refused(tmp_path / "bad.h5", match)


def test_truth_of_a_bad_file(tmp_path):
    with pytest.raises(brdfit.InputError, match=r"none\.h5: no such file; check the path$"):
        read_truth(tmp_path / "none.h5")
    attribute("truth", "{broken")(tmp_path / "a.h5")
    with pytest.raises(brdfit.InputError, match=r"a\.h5: is a damaged brdfit-table: it cannot be read as one"):
        read_truth(tmp_path / "a.h5")


def test_content_decides_not_the_name(tmp_path):
    good(tmp_path / "a.h5")
    (tmp_path / "a.h5").rename(tmp_path / "a.binary")
    assert brdfit.load(tmp_path / "a.binary").channels == 3
    merl(tmp_path / "b.h5")
    assert brdfit.load(tmp_path / "b.h5").material == "b"


@pytest.mark.parametrize("name", ["a.binary", "a.h5"])
def test_failed_write_leaves_the_old_file(tmp_path, name, monkeypatch):
    good(tmp_path / name)
    before = (tmp_path / name).read_bytes()

    def fail(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", fail)
    with pytest.raises(
        brdfit.InputError, match=r"cannot be written \(No space left on device\); check its directory, permiss"
    ):
        good(tmp_path / name)
    assert [p.name for p in tmp_path.iterdir()] == [name]
    assert (tmp_path / name).read_bytes() == before


@pytest.mark.parametrize("name", ["none/a.binary", "none/a.h5"])
def test_no_directory_to_write_to(tmp_path, name):
    with pytest.raises(
        brdfit.InputError, match=r"none/a\.\w+: cannot be written \(No such file or directory\); check its dir"
    ):
        good(tmp_path / name)


def test_unknown_suffix(tmp_path):
    with pytest.raises(
        brdfit.InputError, match=r"a\.csv: no table is written under the suffix '\.csv'; use \.binary or \.h5$"
    ):
        good(tmp_path / "a.csv")


def test_one_black_channel_is_no_fault(tmp_path):
    values = np.ones((3, *SHAPE))
    values[0] = 0
    brdfit.save(replace(table(values, merl_grid(SHAPE), "a"), angles="edge"), tmp_path / "a.binary")
    assert brdfit.load(tmp_path / "a.binary").mask.all()
