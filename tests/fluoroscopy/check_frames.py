#!/usr/bin/env python3
"""Frames of a run, read by nothing of the product: PNGs by zlib, DICOM by the standard's text, landmarks by a pinhole.

usage: check_frames.py TROCAR FOLDER
"""
import json
import math
import shutil
import struct
import subprocess
import sys
import zlib
from pathlib import Path

SCENE = {
    "name": "beads",
    "units": {"length": "mm", "pressure": "kPa"},
    "time": {"step": 0.01, "duration": 0.1},
    "bodies": {},
    "outputs": {"fluoroscopy": {"every": 3, "views": [
        {"name": "ap", "primary": "0 deg", "secondary": "0 deg", "isocentre": [0, 0, 0], "sid": 1050, "sod": 750,
         "detector": [300, 300], "pixels": [256, 256], "display": "linear", "noise": False, "dicom": True},
        {"name": "oblique", "primary": "LAO 40 deg", "secondary": "CAU 25 deg", "isocentre": [5, -10, 20], "table": [3, 1, -4], "sid": 1100, "sod": 720,
         "detector": [200, 260], "pixels": [200, 320], "display": "linear", "noise": False, "dicom": True}]}},
}
BEADS = [(40, -30, 20, 4), (-35, 25, -45, 15), (10, 40, 60, 3)]


def read_png(path):
    """width, height, bits, rows of grey values"""
    data = path.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n", path
    at, packed = 8, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        content = data[at + 8:at + 8 + length]
        assert zlib.crc32(kind + content) == struct.unpack(">I", data[at + 8 + length:at + 12 + length])[0]
        if kind == b"IHDR":
            width, height, bits, colour = struct.unpack(">IIBB", content[:10])
            assert colour == 0 and bits in (8, 16)
        packed += content if kind == b"IDAT" else b""
        at += 12 + length
    raw, step = zlib.decompress(packed), bits // 8
    before, rows = bytes(width * step), []
    for y in range(height):
        kind, line = raw[y * (width * step + 1)], bytearray(raw[y * (width * step + 1) + 1:(y + 1) * (width * step + 1)])
        for i in range(len(line)):
            a, b, c = (line[i - step] if i >= step else 0), before[i], (before[i - step] if i >= step else 0)
            p = a + b - c
            paeth = min((abs(p - a), 0, a), (abs(p - b), 1, b), (abs(p - c), 2, c))[2]
            line[i] = (line[i] + (0, a, b, (a + b) // 2, paeth)[kind]) & 255
        before = bytes(line)
        rows.append(struct.unpack(">%dH" % width, before) if bits == 16 else tuple(before))
    return width, height, bits, rows


def read_dicom(path):
    """elements by tag (PS3.5, explicit VR little endian)"""
    data = path.read_bytes()
    assert data[128:132] == b"DICM" and not any(data[:128])
    found, at, last = {}, 132, 0
    while at < len(data):
        group, element, vr = struct.unpack("<HH2s", data[at:at + 6])
        tag = group << 16 | element
        assert tag > last, "elements ascend"
        last = tag
        if vr in (b"OB", b"OW", b"SQ", b"UN", b"UT"):
            length, = struct.unpack("<I", data[at + 8:at + 12])
            at += 12
        else:
            length, = struct.unpack("<H", data[at + 6:at + 8])
            at += 8
        assert length % 2 == 0 and at + length <= len(data)
        found[tag] = (vr.decode(), data[at:at + length])
        at += length
    return found


def pinhole(view, point):
    """by turning about the axes, not by a matrix of ours: the patient is turned against the arm"""
    p = [a + b - c for a, b, c in zip(point, view.get("table", (0, 0, 0)), view["isocentre"])]
    angle = lambda text: math.radians(float(text.split()[-2])) * (-1 if text[:3] in ("RAO", "CAU") else 1)
    a, b = angle(view["primary"]), angle(view["secondary"])
    front, left = p[1] * math.cos(a) - p[0] * math.sin(a), -p[0] * math.cos(a) - p[1] * math.sin(a)
    depth = view["sod"] + front * math.cos(b) + p[2] * math.sin(b)
    up = p[2] * math.cos(b) - front * math.sin(b)
    (w, h), (columns, rows) = view["detector"], view["pixels"]
    return columns / 2 + left * view["sid"] / depth * columns / w, rows / 2 - up * view["sid"] / depth * rows / h


def chord(matrix, middle, radius, u, v):
    """m, that the ray of a place on the picture runs in a ball: the ray is where two planes meet"""
    p = [[a - u * c for a, c in zip(matrix[0], matrix[2])], [b - v * c for b, c in zip(matrix[1], matrix[2])]]
    (a, b), d = (q[:3] for q in p), [q[3] for q in p]
    cross = lambda s, t: [s[1] * t[2] - s[2] * t[1], s[2] * t[0] - s[0] * t[2], s[0] * t[1] - s[1] * t[0]]
    dot = lambda s, t: sum(x * y for x, y in zip(s, t))
    way = cross(a, b)
    point = [(dot(way, way) and (-d[0] * m + -d[1] * n) / dot(way, way)) for m, n in zip(cross(b, way), cross(way, a))]
    off = [m - q for m, q in zip(middle, point)]
    miss = cross(off, way)
    return 2 * math.sqrt(max(0, radius * radius - dot(miss, miss) / dot(way, way)))


def main():
    trocar, folder = sys.argv[1], Path(sys.argv[2])
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for k, bead in enumerate(BEADS):
        SCENE["bodies"][f"bead{k}"] = {"kind": "static", "surface": {"shape": "sphere", "centre": bead[:3], "radius": bead[3], "subdivisions": 4}}
    SCENE["effects"] = []
    (folder / "scene.json").write_text(json.dumps(SCENE))
    subprocess.run([trocar, "run", str(folder / "scene.json"), "--out", str(folder / "out"), "-n", "6", "--no-report"], check=True, stdout=subprocess.DEVNULL)
    summary = json.loads((folder / "out/summary.json").read_text())
    worst = thickness = 0.0
    for view, described in zip(SCENE["outputs"]["fluoroscopy"]["views"], summary["views"]):
        assert described["name"] == view["name"]
        width, height, bits, rows = read_png(folder / f"out/fluoro/{view['name']}_000006.png")
        assert [width, height] == view["pixels"] and bits == 16 and max(map(max, rows)) == 65535
        matrix = described["projection"]
        for bead, body in zip(BEADS, summary["fluoroscopy"]["bodies"]):
            u, v = pinhole(view, bead[:3])
            x = [1e-3 * c for c in bead[:3]] + [1]
            pu, pv, pw = (sum(m * c for m, c in zip(row, x)) for row in matrix)
            assert abs(pu / pw - u) < 1e-6 and abs(pv / pw - v) < 1e-6, (view["name"], pu / pw, u, pv / pw, v)
            total = mu = mv = 0.0
            reach = int(1.25 * bead[3] * view['sid'] / (view['sod'] - 60) * max(width / view['detector'][0], height / view['detector'][1])) + 2
            for y in range(max(0, int(v) - reach), min(height, int(v) + reach + 1)):
                for c in range(max(0, int(u) - reach), min(width, int(u) + reach + 1)):
                    dark = -math.log(rows[y][c] / 65535)
                    total, mu, mv = total + dark, mu + dark * (c + 0.5), mv + dark * (y + 0.5)
            if bead[3] < 6:  # the middle of a large ball's shadow is not its middle's
                worst = max(worst, abs(mu / total - u), abs(mv / total - v))
            for y in range(int(v) - 2, int(v) + 3):
                for c in range(int(u) - 2, int(u) + 3):
                    wanted = chord(matrix, x[:3], 1e-3 * bead[3], c + 0.5, y + 0.5)
                    if wanted > 1e-3 * bead[3]:
                        thickness = max(thickness, abs(-math.log(rows[y][c] / 65535) / body["attenuation_per_m"] / wanted - 1))
        dicom = read_dicom(folder / f"out/fluoro/{view['name']}.dcm")
        text = lambda tag: dicom[tag][1].decode().strip(" \0")
        assert text(0x00020010) == "1.2.840.10008.1.2.1" and text(0x00080016) == "1.2.840.10008.5.1.4.1.1.12.1" == text(0x00020002)
        assert text(0x00080018) == text(0x00020003) and text(0x00080060) == "XA" and int(text(0x00280008)) == 3
        assert struct.unpack("<I", dicom[0x00020000][1])[0] == sum(8 + (4 if vr in ("OB",) else 0) + len(b) for tag, (vr, b) in dicom.items() if 0x20000 < tag < 0x30000)
        assert math.isclose(float(text(0x00181110)), view["sid"]) and math.isclose(float(text(0x00181111)), view["sod"])
        spacing = [float(s) for s in text(0x00181164).split("\\")]
        assert math.isclose(spacing[0], view["detector"][1] / height) and math.isclose(spacing[1], view["detector"][0] / width)
        if view["name"] == "oblique":
            assert math.isclose(float(text(0x00181510)), 40) and math.isclose(float(text(0x00181511)), -25)
        pixels = struct.unpack("<%dH" % (3 * width * height), dicom[0x7fe00010][1])
        assert list(pixels[2 * width * height:]) == [value for row in rows for value in row], "the last frame"
        try:
            import pydicom
        except ImportError:
            continue
        read = pydicom.dcmread(folder / f"out/fluoro/{view['name']}.dcm")
        assert read.NumberOfFrames == 3 and read.PositionerPrimaryAngle == float(text(0x00181510))
    print(f"landmarks within {worst:.3f} pixel, thickness within {100 * thickness:.2f} %, DICOM read")
    assert worst < 0.1 and thickness < 0.01


main()
