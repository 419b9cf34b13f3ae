"""Places the photographs of a folder: find_cameras.py PICTURES OUT. Writes OUT/sparse/0, 1, …"""

import os
import sys
import threading
import time


def end_with_parent():
    """Nobody waits for the result once the program that asked for it has gone."""
    parent = os.getppid()
    while os.getppid() == parent:
        time.sleep(1)
    os._exit(1)


def main():
    threading.Thread(target=end_with_parent, daemon=True).start()
    import pycolmap

    pictures, out = sys.argv[1:3]
    database = os.path.join(out, "database.db")
    if hasattr(pycolmap, "set_random_seed"):
        pycolmap.set_random_seed(1)
    reader = pycolmap.ImageReaderOptions()
    reader.camera_model = "RADIAL"
    mode = pycolmap.CameraMode.PER_FOLDER
    pycolmap.extract_features(database, pictures, camera_mode=mode, reader_options=reader)
    pycolmap.match_exhaustive(database)
    options = pycolmap.IncrementalPipelineOptions()
    options.min_model_size = 2
    sparse = os.path.join(out, "sparse")
    found = pycolmap.incremental_mapping(database, pictures, sparse, options)
    if not found:
        raise RuntimeError("no reconstruction was found")


try:
    main()
except Exception as error:  # told in one line; the caller says what to do
    print(f"error: {type(error).__name__}: {error}", flush=True)
    sys.exit(3)
