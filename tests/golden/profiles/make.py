"""Photographs with ICC profiles, and their colours in linear Rec. 709 by colour-science 0.4 (Bradford).

    pip install colour-science pillow numpy && python3 make.py

The profiles are packed here (ICC.1:2022): three colorants under D50 and three curves. LittleCMS reads
them, too, and must agree on 8 bits.
"""
import io
import json
import struct
import zlib

import colour
import numpy as np
from PIL import Image, ImageCms

BLOCK = 16
D50 = np.array([0.9642, 1.0, 0.8249])  # ICC.1:2022, 7.2.16


def fixed(value):
    return struct.pack(">i", round(value * 65536))


def profile(space, curve, extra=()):
    """An ICC profile of `space`; `curve` is the body of its tone curves."""
    adapt = colour.adaptation.matrix_chromatic_adaptation_VonKries(
        colour.xy_to_XYZ(space.whitepoint), D50, transform="Bradford"
    )
    colorants = (adapt @ space.matrix_RGB_to_XYZ).T
    text = b"text\0\0\0\0public domain\0"
    name = "made for tests".encode("utf-16-be")
    desc = b"mluc\0\0\0\0" + struct.pack(">IIHHII", 1, 12, 0x656E, 0x5553, len(name), 28) + name
    white = b"XYZ \0\0\0\0" + b"".join(map(fixed, D50))
    tags = [(b"desc", desc), (b"cprt", text), (b"wtpt", white)]
    for letter, colorant in zip("rgb", colorants):
        tags.append((letter.encode() + b"XYZ", b"XYZ \0\0\0\0" + b"".join(map(fixed, colorant))))
        if curve is not None:
            tags.append((letter.encode() + b"TRC", curve))
    start = 128 + 4 + 12 * len(tags)
    table, data = struct.pack(">I", len(tags)), b""
    for tag, body in tags:
        body += b"\0" * (-len(body) % 4)
        table += tag + struct.pack(">II", start + len(data), len(body))
        data += body
    head = struct.pack(">I4sI4s4s4s", start + len(data), b"\0\0\0\0", 0x04300000, b"mntr", b"RGB ", b"XYZ ")
    head += struct.pack(">6H", 2026, 1, 1, 0, 0, 0) + b"acsp" + b"\0" * 28
    head += b"".join(map(fixed, D50))
    return head.ljust(128, b"\0") + table + data


def parametric(kind, *values):
    return b"para\0\0\0\0" + struct.pack(">HH", kind, 0) + b"".join(map(fixed, values))


def sampled(function, count):
    values = [round(65535 * function(i / (count - 1))) for i in range(count)]
    return b"curv\0\0\0\0" + struct.pack(f">I{count}H", count, *values)


SRGB = parametric(3, 2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045)
GAMMA = 563 / 256  # Adobe RGB's, as its profile has it
ADOBE = b"curv\0\0\0\0" + struct.pack(">IH", 1, 563)
PROPHOTO = sampled(lambda x: x / 16 if x < 16 / 512 else x**1.8, 1024)


def png16(path, pixels, icc):
    """Pillow writes no colour of 16 bits."""
    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    rows = b"".join(b"\0" + row.astype(">u2").tobytes() for row in pixels)
    height, width, _ = pixels.shape
    with open(path, "wb") as out:
        out.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 16, 2, 0, 0, 0)))
        out.write(chunk(b"iCCP", b"test\0\0" + zlib.compress(icc, 9)))
        out.write(chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b""))


# Codes of 8 bits that no clipping touches; the first is a grey, which sets the scale.
patches = np.array([[128, 128, 128], [60, 60, 60], [200, 200, 200], [200, 60, 40], [50, 180, 70],
                    [40, 70, 190], [220, 210, 60], [190, 80, 180], [60, 190, 200], [90, 120, 60]])
target = colour.RGB_COLOURSPACES["ITU-R BT.709"].copy()
target.use_derived_transformation_matrices(True)
found = {}
for name, file, curve, decode in [
    ("Display P3", "p3", SRGB, colour.models.eotf_sRGB),
    ("Adobe RGB (1998)", "adobe", ADOBE, lambda v: v**GAMMA),
    ("ROMM RGB", "romm", PROPHOTO, lambda v: np.where(v < 16 / 512, v / 16, v**1.8)),
]:
    space = colour.RGB_COLOURSPACES[name].copy()
    space.use_derived_transformation_matrices(True)
    linear = colour.RGB_to_RGB(decode(patches / 255), space, target, "Bradford")
    icc = profile(space, curve)
    pixels = np.repeat(np.repeat(patches[None], BLOCK, 0), BLOCK, 1).astype(np.uint8)
    picture = Image.fromarray(pixels)
    picture.save(f"{file}.tif", icc_profile=icc, compression="tiff_lzw")
    picture.save(f"{file}.jpg", icc_profile=icc, quality=100, subsampling=0)
    png16(f"{file}.png", pixels.astype(np.uint16) * 257, icc)
    # LittleCMS, to 8 bits of sRGB, where Rec. 709 can make the colour.
    theirs = ImageCms.profileToProfile(picture, ImageCms.ImageCmsProfile(io.BytesIO(icc)), ImageCms.createProfile("sRGB"),
                                       renderingIntent=ImageCms.Intent.RELATIVE_COLORIMETRIC)
    theirs = np.asarray(theirs)[0, BLOCK // 2 :: BLOCK].astype(float)
    ours = 255 * colour.models.eotf_inverse_sRGB(np.clip(linear, 0, 1))
    inside = np.all((linear > 0) & (linear < 1), axis=1)
    assert inside.sum() >= 5 and np.abs(theirs - ours)[inside].max() < 1.5, (name, theirs, ours)
    found[name] = {"file": file, "rec709": linear.tolist()}
# No curves, and a profile that is cut off.
icc = profile(target, None)
Image.new("RGB", (BLOCK, BLOCK), (128, 90, 60)).save("no-curves.tif", icc_profile=icc, compression="tiff_lzw")
Image.new("RGB", (BLOCK, BLOCK), (128, 90, 60)).save("cut.tif", icc_profile=icc[:200], compression="tiff_lzw")
with open("expected.json", "w") as out:
    json.dump({"made_by": f"colour-science {colour.__version__}", "block": BLOCK, "spaces": found}, out, indent=1)
    out.write("\n")
