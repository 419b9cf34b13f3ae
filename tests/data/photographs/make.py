"""Writes lossless.dng, a 12-bit Bayer DNG compressed as lossless JPEG by liblj92, and small files of other kinds.

pip install imagecodecs numpy pillow tifffile
"""

import imagecodecs
import numpy as np
import tifffile

width, height, bits = 48, 32, 12
y, x = np.mgrid[0:height, 0:width]
samples = (300 + (37 * x + 61 * y + 5 * x * y) % 3500).astype(np.uint16)

# As cameras do it: two samples of a row are the components of one pixel.
encoded = imagecodecs.ljpeg_encode(samples, bitspersample=bits)

RATIONAL, SIGNED = 5, 10
matrix = [19549, -7877, -2582, -5724, 10121, 1917, -1267, -110, 6621]
with tifffile.TiffWriter("lossless.dng", byteorder="<") as tiff:
    tiff.write(
        iter([encoded]),
        shape=(height, width),
        dtype=np.uint16,
        bitspersample=bits,
        photometric=32803,
        compression=7,
        tile=(height, width),
        software=False,
        metadata=None,
        extratags=[
            (271, 2, 0, "Nobody", True),
            (272, 2, 0, "Lossless", True),
            (33421, 3, 2, (2, 2), True),
            (33422, 1, 4, bytes([2, 1, 1, 0]), True),
            (33434, RATIONAL, 1, (1, 60), True),
            (34855, 3, 1, 100, True),
            (50706, 1, 4, bytes([1, 4, 0, 0]), True),
            (50708, 2, 0, "Nobody Lossless", True),
            (50714, 3, 1, 256, True),
            (50717, 3, 1, (1 << bits) - 1, True),
            (50721, SIGNED, 9, tuple(v for m in matrix for v in (m, 10000)), True),
            (50728, RATIONAL, 3, (1, 1, 1, 1, 1, 1), True),
            (50778, 3, 1, 21, True),
        ],
    )

# Beginnings for changed files: a JPEG with EXIF, a compressed 16-bit TIFF, a response.
from PIL import Image

colors = np.stack([x * 5, y * 7, x + y], axis=-1).astype(np.uint8)
picture = Image.fromarray(colors)
exif = picture.getexif()
exif.get_ifd(0x8769).update({33434: (1, 60), 33437: 8.0, 34855: 100, 36867: "2026:11:22 05:06:07"})
picture.save("exif.jpg", quality=80, exif=exif)
tifffile.imwrite("deep.tif", colors.astype(np.uint16) * 257, compression="zlib", predictor=True,
                 photometric="rgb", software=False, metadata=None)
with open("response.csv", "w") as table:
    table.write("value,red,green,blue\n")
    for code in range(256):
        table.write(",".join([str(code)] + [f"{((code + 1) / 129) ** g:.6f}" for g in (2, 2.2, 2.4)]) + "\n")
